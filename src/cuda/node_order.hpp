// Nodes in memory: cubes of 2x2x2, which are one 32-byte sector in mixed precision. A tile of 8x8x8 is 64 whole cubes,
// a block of 4x4x4 is eight of them, so that whatever part of a block a tile reaches is read in whole sectors.
#pragma once

#include "breccia/macros.hpp"
#include "grid/layout.hpp"

namespace breccia::cuda {

struct NodePosition {
  int x, y, z;
};

/// Node n of a cube-ordered array of `width`^3 nodes.
template <int kWidth>
BRECCIA_HD NodePosition node_position(int n) {
  constexpr int cubes = kWidth / 2;
  const int cube = n >> 3;
  return {2 * (cube / (cubes * cubes)) + (n >> 2 & 1), 2 * (cube / cubes % cubes) + (n >> 1 & 1),
          2 * (cube % cubes) + (n & 1)};
}
template <int kWidth>
BRECCIA_HD int node_place(int x, int y, int z) {
  constexpr int cubes = kWidth / 2;
  return (((x >> 1) * cubes + (y >> 1)) * cubes + (z >> 1)) << 3 | (x & 1) << 2 | (y & 1) << 1 | (z & 1);
}

/// A node of a tile along one axis: its block (0 below, 1 own, 2 above) and its place inside.
BRECCIA_HD int block_of_tile_node(int n) { return (n + grid::kBlockWidth - grid::kTileMargin) / grid::kBlockWidth; }
BRECCIA_HD int node_of_tile_node(int n) { return (n + grid::kBlockWidth - grid::kTileMargin) % grid::kBlockWidth; }

}  // namespace breccia::cuda

// Copies between blocks and the nodes of a tile, whose layers fit the first-level cache. Only the box that particles
// touch is copied, along z by pairs of nodes: a pair is a cache line in mixed precision and never crosses blocks.
#pragma once

#include "grid/tile_velocities.hpp"

namespace breccia::grid {

namespace detail {

inline constexpr int kPairs = kTileHeight / 2;
/// Which of the blocks along z holds pair p of tile nodes, and where in it.
constexpr int pair_block(int p) { return (2 * p + kBlockWidth - kTileMargin) / kBlockWidth; }
constexpr int pair_start(int p) { return (2 * p + kBlockWidth - kTileMargin) % kBlockWidth; }
static_assert(kTileMargin % 2 == 0 && kBlockWidth % 2 == 0, "no pair crosses blocks");

/// The part of a box that lies in blocks above each other.
struct Column {
  const std::uint32_t* blocks;  ///< along z
  int in_block;                 ///< first node of the first row, in a block
  int in_tile;                  ///< and in the tile
  int rows_x, rows_y;
};

/// Calls visit(column) for the columns of a box.
template <class F>
BRECCIA_HD void for_each_column(const Tile& tile, const TileBox& box, F&& visit) {
  // Tile nodes of the blocks below, own and above along an axis.
  constexpr int kFirst[3] = {0, kTileMargin, kTileMargin + kBlockWidth};
  constexpr int kLast[3] = {kTileMargin - 1, kTileMargin + kBlockWidth - 1, kTileWidth - 1};
  constexpr int kStart[3] = {kBlockWidth - kTileMargin, 0, 0};
  for (int bx = 0; bx < 3; ++bx) {
    const int x = box.low[0] > kFirst[bx] ? box.low[0] : kFirst[bx];
    const int rows_x = (box.high[0] < kLast[bx] ? box.high[0] : kLast[bx]) - x + 1;
    if (rows_x <= 0) continue;
    for (int by = 0; by < 3; ++by) {
      const int y = box.low[1] > kFirst[by] ? box.low[1] : kFirst[by];
      const int rows_y = (box.high[1] < kLast[by] ? box.high[1] : kLast[by]) - y + 1;
      const int row = (x - kFirst[bx] + kStart[bx]) * kBlockWidth + (y - kFirst[by] + kStart[by]);
      visit(Column{tile.neighbours + (bx * 3 + by) * kNeighboursAlongZ, row * kBlockWidth, tile_index(x, y, 0), rows_x,
                   rows_y});
    }
  }
}

/// Calls pair(row in the block, row in the tile, p) for the pairs p of a column, rows counted in nodes from the first.
template <class F>
BRECCIA_HD void for_each_pair(const Column& column, const TileBox& box, F&& pair) {
  const int first = box.low[2] / 2;
  const int last = box.high[2] / 2;
  const bool all = first == 0 && last == kPairs - 1;
  for (int x = 0; x < column.rows_x; ++x) {
    for (int y = 0; y < column.rows_y; ++y) {
      const int in_block = (x * kBlockWidth + y) * kBlockWidth;
      const int in_tile = tile_index(x, y, 0);
      if (all) {
        // Unrolled, so that the cache misses of a row overlap.
        for (int p = 0; p < kPairs; ++p) pair(in_block, in_tile, p);
      } else {
        for (int p = first; p <= last; ++p) pair(in_block, in_tile, p);
      }
    }
  }
}

constexpr std::size_t at(std::uint32_t block, int node) {
  return (std::size_t{block} * kBlockNodes + static_cast<std::size_t>(node)) * kChannels;
}

/// Where the pairs of a column begin; blocks that the tile does not know are replaced by `instead`.
template <class Real>
struct PairStarts {
  Real* pair[kPairs];
  BRECCIA_HD PairStarts(const Column& column, Real* blocks, Real* instead) {
    for (int p = 0; p < kPairs; ++p) {
      const std::uint32_t block = column.blocks[pair_block(p)];
      const int node = column.in_block + pair_start(p);
      pair[p] = block == kNoBlock ? instead + node * kChannels : blocks + at(block, node);
    }
  }
};

/// Nodes of no block: zero wherever a tile may look.
template <class Real>
inline constexpr Real kNoNodes alignas(64)[kBlockNodes * kChannels] = {};

}  // namespace detail

/// The nodes of the box from the blocks. A box reaches only blocks that the tile knows.
template <class P>
BRECCIA_HD void load_tile(const Tile& tile, const TileBox& box, const typename P::Real* blocks,
                          typename P::Real* nodes) {
  using N = TwoNodes<P>;
  detail::for_each_column(tile, box, [&](const detail::Column& column) BRECCIA_INLINE_LAMBDA {
    // Where a box ends inside a pair, the other node may belong to a block that no particle reaches.
    const detail::PairStarts<const typename P::Real> from(column, blocks, detail::kNoNodes<typename P::Real>);
    detail::for_each_pair(column, box, [&](int in_block, int in_tile, int p) BRECCIA_INLINE_LAMBDA {
      put_velocities<P>(N::load(from.pair[p] + in_block * kChannels), column.in_tile + in_tile + 2 * p, nodes);
    });
  });
}

/// Adds the nodes of the box to their blocks and zeroes them. Returns true if mass has reached a block that no particle
/// of the tile could reach at the last sorting: a particle has drifted more than the margin allows. `beyond`: a block
/// of zeros, left as such.
template <class P>
[[nodiscard]] BRECCIA_HD bool add_tile(const Tile& tile, const TileBox& box, typename P::Real* nodes,
                                       typename P::Real* blocks, typename P::Real* beyond) {
  using N = TwoNodes<P>;
  bool unknown = false;
  detail::for_each_column(tile, box, [&](const detail::Column& column) BRECCIA_INLINE_LAMBDA {
    const detail::PairStarts<typename P::Real> to(column, blocks, beyond);
    for (int bz = 0; bz < kNeighboursAlongZ; ++bz) unknown = unknown || column.blocks[bz] == kNoBlock;
    detail::for_each_pair(column, box, [&](int in_block, int in_tile, int p) BRECCIA_INLINE_LAMBDA {
      typename P::Real* sum = to.pair[p] + in_block * kChannels;
      typename P::Real* node = nodes + (column.in_tile + in_tile + 2 * p) * kChannels;
      (N::load(sum) + N::load(node)).store(sum);
      N(typename P::Real(0)).store(node);
    });
  });
  bool lost = false;
  for (int n = 0; unknown && n < kBlockNodes; ++n) {
    lost = lost || beyond[n * kChannels + kMass] != typename P::Real(0);
  }
  for (int n = 0; lost && n < kBlockNodes * kChannels; ++n) beyond[n] = typename P::Real(0);
  return lost;
}

/// Marks the rows of the blocks that a box reaches.
BRECCIA_HD void mark_rows(const Tile& tile, const TileBox& box, RowMask* rows) {
  // Nodes of a tile to those of the block below, its own and the one above, four bits each.
  const auto touched = [&](int axis, int block) BRECCIA_INLINE_LAMBDA {
    const unsigned all = (2U << box.high[axis]) - (1U << box.low[axis]);
    return (all << (kBlockWidth - kTileMargin)) >> (kBlockWidth * block) & 0xfU;
  };
  for (int bx = 0; bx < 3; ++bx) {
    const unsigned x = touched(0, bx);
    const unsigned spread = (x & 1U) | (x & 2U) << 3 | (x & 4U) << 6 | (x & 8U) << 9;
    for (int by = 0; by < 3; ++by) {
      const unsigned mask = spread * touched(1, by);
      for (int bz = 0; bz < kNeighboursAlongZ; ++bz) {
        const std::uint32_t block = tile.neighbours[(bx * 3 + by) * kNeighboursAlongZ + bz];
        if (block == kNoBlock || touched(2, bz) == 0) continue;
        for (int h = 0; h < 2; ++h) {
          std::uint8_t& half = rows[block].half[h];
          const unsigned here = mask >> (8 * h) & 0xffU;
          if (here != 0) half = static_cast<std::uint8_t>(half | here);
        }
      }
    }
  }
}

}  // namespace breccia::grid

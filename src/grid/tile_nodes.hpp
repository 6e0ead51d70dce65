// Copies between blocks and the 8x8x8 nodes of a tile that stay in the first-level cache. Only the box that particles
// touch is copied, along z by pairs of nodes: a pair is a cache line in mixed precision and never crosses blocks.
#pragma once

#include "grid/tile.hpp"

namespace breccia::grid {

namespace detail {

inline constexpr int kPairs = kTileWidth / 2;
/// Which of the three blocks along z holds a pair of tile nodes, and where in it.
inline constexpr int kPairBlock[kPairs] = {0, 1, 1, 2};
inline constexpr int kPairStart[kPairs] = {kBlockWidth - kTileMargin, 0, 2, 0};
static_assert(kTileMargin == 2 && kBlockWidth == 4, "the tables above hold for these");

/// Coordinates of a tile node along an axis: block below, own or above, and node inside it.
constexpr int block_of_node(int n) { return (n + kBlockWidth - kTileMargin) / kBlockWidth; }
constexpr int node_in_block(int n) { return (n + kBlockWidth - kTileMargin) % kBlockWidth; }

// Calls row(blocks along z, first node of the row in a block, first node in the tile) for the rows of a box.
template <class F>
BRECCIA_HD void for_each_row(const Tile& tile, const TileBox& box, F&& row) {
  for (int x = box.low[0]; x <= box.high[0]; ++x) {
    for (int y = box.low[1]; y <= box.high[1]; ++y) {
      row(tile.neighbours + (block_of_node(x) * 3 + block_of_node(y)) * 3,
          (node_in_block(x) * kBlockWidth + node_in_block(y)) * kBlockWidth, tile_index(x, y, 0));
    }
  }
}

// Calls pair(block, node in it, node in the tile) for the pairs of a box.
template <class F>
BRECCIA_HD void for_each_pair(const Tile& tile, const TileBox& box, F&& pair) {
  const int first = box.low[2] / 2;
  const int last = box.high[2] / 2;
  const bool all = first == 0 && last == kPairs - 1;
  for_each_row(tile, box, [&](const std::uint32_t* blocks, int in_block, int in_tile) BRECCIA_INLINE_LAMBDA {
    if (all) {
      // Unrolled, so that the cache misses of a row overlap.
      for (int p = 0; p < kPairs; ++p) pair(blocks[kPairBlock[p]], in_block + kPairStart[p], in_tile + 2 * p);
    } else {
      for (int p = first; p <= last; ++p) pair(blocks[kPairBlock[p]], in_block + kPairStart[p], in_tile + 2 * p);
    }
  });
}

template <class P>
using TwoNodes = Pack<typename P::Real, 2 * kChannels>;

constexpr std::size_t at(std::uint32_t block, int node) {
  return (std::size_t{block} * kBlockNodes + static_cast<std::size_t>(node)) * kChannels;
}

}  // namespace detail

/// The nodes of the box from the blocks. A box reaches only blocks that the tile knows.
template <class P>
BRECCIA_HD void load_tile(const Tile& tile, const TileBox& box, const typename P::Real* blocks,
                          typename P::Real* nodes) {
  using N = detail::TwoNodes<P>;
  detail::for_each_pair(tile, box, [&](std::uint32_t block, int in_block, int in_tile) BRECCIA_INLINE_LAMBDA {
    // Where a box ends inside a pair, the other node may belong to a block that no particle reaches.
    const N value = block == kNoBlock ? N(typename P::Real(0)) : N::load(blocks + detail::at(block, in_block));
    value.store(nodes + in_tile * kChannels);
  });
}

/// Asks for the nodes of a box ahead of their use; `write`: they will be added to.
template <class P, int kWrite>
BRECCIA_HD void prefetch_tile(const Tile& tile, const TileBox& box, const typename P::Real* blocks) {
  constexpr std::size_t kLine = 64;
  detail::for_each_pair(tile, box, [&](std::uint32_t block, int in_block, int) BRECCIA_INLINE_LAMBDA {
    if (block == kNoBlock) return;
    const auto* pair = reinterpret_cast<const char*>(blocks + detail::at(block, in_block));
    for (std::size_t line = 0; line < sizeof(detail::TwoNodes<P>); line += kLine) {
      __builtin_prefetch(pair + line, kWrite, 2);
    }
  });
}

/// Adds the nodes of the box to their blocks. Returns true if mass has reached a block that no particle of the tile
/// could reach at the last sorting: a particle has drifted more than the margin allows.
template <class P>
[[nodiscard]] BRECCIA_HD bool add_tile(const Tile& tile, const TileBox& box, const typename P::Real* nodes,
                                       typename P::Real* blocks) {
  using N = detail::TwoNodes<P>;
  bool lost = false;
  detail::for_each_pair(tile, box, [&](std::uint32_t block, int in_block, int in_tile) BRECCIA_INLINE_LAMBDA {
    const typename P::Real* from = nodes + in_tile * kChannels;
    if (block == kNoBlock) {
      lost = lost || from[kMass] != typename P::Real(0) || from[kChannels + kMass] != typename P::Real(0);
      return;
    }
    typename P::Real* to = blocks + detail::at(block, in_block);
    (N::load(to) + N::load(from)).store(to);
  });
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
      for (int bz = 0; bz < 3; ++bz) {
        const std::uint32_t block = tile.neighbours[(bx * 3 + by) * 3 + bz];
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

/// Zeroes the nodes that the particles of a tile can reach in one step from those of `box`.
template <class P>
BRECCIA_HD void clear_tile(const TileBox& box, typename P::Real* nodes) {
  using N = detail::TwoNodes<P>;
  TileBox wider;
  for (int axis = 0; axis < 3; ++axis) {
    wider.low[axis] = static_cast<std::int8_t>(box.low[axis] > 0 ? box.low[axis] - 1 : 0);
    wider.high[axis] = static_cast<std::int8_t>(box.high[axis] < kTileWidth - 1 ? box.high[axis] + 1 : kTileWidth - 1);
  }
  for (int x = wider.low[0]; x <= wider.high[0]; ++x) {
    for (int y = wider.low[1]; y <= wider.high[1]; ++y) {
      for (int z = wider.low[2] & ~1; z <= wider.high[2]; z += 2) {
        N(typename P::Real(0)).store(nodes + tile_index(x, y, z) * kChannels);
      }
    }
  }
}

}  // namespace breccia::grid

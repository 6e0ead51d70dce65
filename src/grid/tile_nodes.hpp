// Copies between blocks and the 8x8x8 nodes of a tile that stay in the first-level cache.
#pragma once

#include "grid/tile.hpp"

namespace breccia::grid {

namespace detail {

// The stretches of nodes along an axis that a tile shares with the blocks below, at and above its own.
inline constexpr int kLength[3] = {kTileMargin, kBlockWidth, kTileMargin};
inline constexpr int kBlockStart[3] = {kBlockWidth - kTileMargin, 0, 0};
inline constexpr int kTileStart[3] = {0, kTileMargin, kTileMargin + kBlockWidth};

// Calls run.operator()<nodes>(block, first node in the block, first node in the tile) for the runs along z of a tile.
// Lengths are compile-time constants: copies of two and four nodes without branches overlap their cache misses.
template <class F>
BRECCIA_HD void for_each_run(const Tile& tile, F&& run) {
  for (int bx = 0; bx < 3; ++bx) {
    for (int by = 0; by < 3; ++by) {
      const std::uint32_t* blocks = tile.neighbours + (bx * 3 + by) * 3;
      for (int x = 0; x < kLength[bx]; ++x) {
        for (int y = 0; y < kLength[by]; ++y) {
          const int in_block = ((kBlockStart[bx] + x) * kBlockWidth + kBlockStart[by] + y) * kBlockWidth;
          const int in_tile = ((kTileStart[bx] + x) * kTileWidth + kTileStart[by] + y) * kTileWidth;
          run.template operator()<kLength[0]>(blocks[0], in_block + kBlockStart[0], in_tile + kTileStart[0]);
          run.template operator()<kLength[1]>(blocks[1], in_block + kBlockStart[1], in_tile + kTileStart[1]);
          run.template operator()<kLength[2]>(blocks[2], in_block + kBlockStart[2], in_tile + kTileStart[2]);
        }
      }
    }
  }
}

}  // namespace detail

/// Tile nodes from blocks; nodes of blocks it does not reach become zero.
template <class P>
BRECCIA_HD void load_tile(const Tile& tile, const typename P::Real* blocks, typename P::Real* nodes) {
  using N = Node<P>;
  detail::for_each_run(tile, [&]<int kNodes>(std::uint32_t block, int in_block, int in_tile) BRECCIA_INLINE_LAMBDA {
    typename P::Real* to = nodes + in_tile * kChannels;
    if (block == kNoBlock) {
      for (int i = 0; i < kNodes; ++i) N{}.store(to + i * kChannels);
      return;
    }
    const typename P::Real* from =
        blocks + (std::size_t{block} * kBlockNodes + static_cast<std::size_t>(in_block)) * kChannels;
    for (int i = 0; i < kNodes; ++i) N::load(from + i * kChannels).store(to + i * kChannels);
  });
}

/// Adds tile nodes to their blocks. Returns true if mass has reached a block that no particle of the tile could reach
/// at the last sorting: a particle has drifted more than the margin allows.
template <class P>
[[nodiscard]] BRECCIA_HD bool add_tile(const Tile& tile, const typename P::Real* nodes, typename P::Real* blocks) {
  using N = Node<P>;
  bool lost = false;
  detail::for_each_run(tile, [&]<int kNodes>(std::uint32_t block, int in_block, int in_tile) BRECCIA_INLINE_LAMBDA {
    const typename P::Real* from = nodes + in_tile * kChannels;
    if (block == kNoBlock) {
      for (int i = 0; i < kNodes; ++i) lost = lost || from[i * kChannels + kMass] != typename P::Real(0);
      return;
    }
    typename P::Real* to = blocks + (std::size_t{block} * kBlockNodes + static_cast<std::size_t>(in_block)) * kChannels;
    for (int i = 0; i < kNodes; ++i)
      (N::load(to + i * kChannels) + N::load(from + i * kChannels)).store(to + i * kChannels);
  });
  return lost;
}

template <class P>
BRECCIA_HD void clear_tile(typename P::Real* nodes) {
  for (int i = 0; i < kTileNodes; ++i) Node<P>{}.store(nodes + i * kChannels);
}

}  // namespace breccia::grid

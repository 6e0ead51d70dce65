// Copies between blocks and the 8x8x8 nodes of a tile that stay in the first-level cache.
#pragma once

#include "grid/tile.hpp"

namespace breccia::grid {

namespace detail {

// Calls run(block, first node in the block, first node in the tile, nodes) for the runs along z that make up a tile.
template <class F>
BRECCIA_HD void for_each_run(const Tile& tile, F&& run) {
  constexpr int from_lower = kBlockWidth - kTileMargin;  // block-local node where the lower margin starts
  constexpr int length[3] = {kTileMargin, kBlockWidth, kTileMargin};
  constexpr int block_start[3] = {from_lower, 0, 0};
  constexpr int tile_start[3] = {0, kTileMargin, kTileMargin + kBlockWidth};
  for (int bx = 0; bx < 3; ++bx) {
    for (int by = 0; by < 3; ++by) {
      for (int bz = 0; bz < 3; ++bz) {
        const std::uint32_t block = tile.neighbours[(bx * 3 + by) * 3 + bz];
        for (int x = 0; x < length[bx]; ++x) {
          for (int y = 0; y < length[by]; ++y) {
            const int in_block =
                ((block_start[bx] + x) * kBlockWidth + block_start[by] + y) * kBlockWidth + block_start[bz];
            const int in_tile = ((tile_start[bx] + x) * kTileWidth + tile_start[by] + y) * kTileWidth + tile_start[bz];
            run(block, in_block, in_tile, length[bz]);
          }
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
  detail::for_each_run(tile, [&](std::uint32_t block, int in_block, int in_tile, int length) BRECCIA_INLINE_LAMBDA {
    typename P::Real* to = nodes + in_tile * kChannels;
    if (block == kNoBlock) {
      for (int i = 0; i < length; ++i) N{}.store(to + i * kChannels);
      return;
    }
    const typename P::Real* from =
        blocks + (std::size_t{block} * kBlockNodes + static_cast<std::size_t>(in_block)) * kChannels;
    for (int i = 0; i < length; ++i) N::load(from + i * kChannels).store(to + i * kChannels);
  });
}

/// Adds tile nodes to their blocks. Returns true if mass has reached a block that no particle of the tile could reach
/// at the last sorting: a particle has drifted more than the margin allows.
template <class P>
[[nodiscard]] BRECCIA_HD bool add_tile(const Tile& tile, const typename P::Real* nodes, typename P::Real* blocks) {
  using N = Node<P>;
  bool lost = false;
  detail::for_each_run(tile, [&](std::uint32_t block, int in_block, int in_tile, int length) BRECCIA_INLINE_LAMBDA {
    const typename P::Real* from = nodes + in_tile * kChannels;
    if (block == kNoBlock) {
      for (int i = 0; i < length; ++i) lost = lost || from[i * kChannels + kMass] != typename P::Real(0);
      return;
    }
    typename P::Real* to = blocks + (std::size_t{block} * kBlockNodes + static_cast<std::size_t>(in_block)) * kChannels;
    for (int i = 0; i < length; ++i)
      (N::load(to + i * kChannels) + N::load(from + i * kChannels)).store(to + i * kChannels);
  });
  return lost;
}

template <class P>
BRECCIA_HD void clear_tile(typename P::Real* nodes) {
  for (int i = 0; i < kTileNodes; ++i) Node<P>{}.store(nodes + i * kChannels);
}

}  // namespace breccia::grid

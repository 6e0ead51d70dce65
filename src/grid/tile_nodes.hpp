// The nodes of a tile: columns of the blocks around it, in which particles read velocities and add up sums in place.
#pragma once

#include "grid/node_velocities.hpp"

namespace breccia::grid {

/// Where the columns that stencils of a tile reach begin, z = 0 of the tile. Stencils that begin in Tile::starts reach
/// only nodes that exist. A gather loads a fourth node along z and drops it: it may be that of a column far away, which
/// another thread is just changing.
template <class P>
struct TileNodes {
  using Real = typename P::Real;

  const Real* velocities[kTileColumns];
  Real* sums[kTileColumns];
  std::size_t rest;  ///< from the first array of velocities to the second

  BRECCIA_HD void set_velocities(const Tile& tile, const Real* all, std::size_t places) {
    rest = rest_distance(places);
    for_each_column(tile, [&](int column, std::size_t place)
                              BRECCIA_INLINE_LAMBDA { velocities[column] = all + place * kVelocityStride<P>; });
  }
  BRECCIA_HD void set_sums(const Tile& tile, Real* all) {
    for_each_column(
        tile, [&](int column, std::size_t place) BRECCIA_INLINE_LAMBDA { sums[column] = all + place * kChannels; });
  }
  /// In place of these: sums of the tile alone, [kTileColumns][kTileHeight][kChannels] zeros.
  BRECCIA_HD void set_sums_apart(Real* apart) {
    for (int column = 0; column < kTileColumns; ++column) sums[column] = apart + column * kTileHeight * kChannels;
  }
  /// Moves them to where set_sums would have put them; `box`: the nodes that got something.
  BRECCIA_HD void add_sums(const Tile& tile, const TileBox& box, Real* all) const {
    for (int x = box.low[0]; x <= box.high[0]; ++x) {
      for (int y = box.low[1]; y <= box.high[1]; ++y) {
        Real* const from = sums[column_index(x, y)];
        Real* const to = all + place(tile, x, y) * kChannels;
        for (int n = box.low[2] * kChannels; n < (box.high[2] + 1) * kChannels; ++n) {
          to[n] += from[n];
          from[n] = Real(0);
        }
      }
    }
  }

  /// Of node z = 0 of column (x, y); the tile must reach that column.
  BRECCIA_HD static std::size_t place(const Tile& tile, int x, int y) {
    constexpr int kBelow = kBlockWidth - kTileMargin;  // nodes of the block below that are no part of the tile
    const int in_x = x + kBelow;
    const int in_y = y + kBelow;
    const TileColumns& columns = tile.columns[in_x / kBlockWidth * 3 + in_y / kBlockWidth];
    const int n = in_x % kBlockWidth * kBlockWidth + in_y % kBlockWidth;
    return columns.first + static_cast<std::size_t>(n) * columns.height;
  }

 private:
  template <class F>
  BRECCIA_HD static void for_each_column(const Tile& tile, F&& visit) {
    for (int x = tile.starts.low[0]; x <= tile.starts.high[0] + 2; ++x) {
      for (int y = tile.starts.low[1]; y <= tile.starts.high[1] + 2; ++y) visit(column_index(x, y), place(tile, x, y));
    }
  }
};

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

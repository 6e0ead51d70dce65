// Particles counted by tile and cell: what a sorting needs to know where each goes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "grid/tile.hpp"

namespace breccia::grid {

/// A cell, from the lowest of its stack.
struct CellInStack {
  int x, y, z;

  /// In storage order: layers of two cells along z, whose stencils begin at the same pair of nodes (scatter_pairs.hpp);
  /// in a layer columns, in a column its two cells. So particles that follow each other mostly share their stencil.
  [[nodiscard]] constexpr std::uint32_t index() const {
    const int pair = (z + 1) / 2;
    const int column = y * kBlockWidth + x;
    const bool whole = z > 0 && z < kStackHeight - 1;
    const int before = kBlockWidth * kBlockWidth * (pair == 0 ? 0 : 2 * pair - 1);
    return static_cast<std::uint32_t>(before + (whole ? 2 * column + ((z + 1) & 1) : column));
  }
  [[nodiscard]] constexpr std::int32_t packed() const {
    return (x + kNodeBias) | (y + kNodeBias) << 8 | (z + kNodeBias) << 16;
  }
};

/// The cells of a stack in storage order.
inline constexpr std::array<CellInStack, kStackCells> kCellsInOrder = [] {
  std::array<CellInStack, kStackCells> cells{};
  for (int n = 0; n < kStackCells; ++n) {
    const CellInStack cell{n % kBlockWidth, n / kBlockWidth % kBlockWidth, n / (kBlockWidth * kBlockWidth)};
    cells[cell.index()] = cell;
  }
  return cells;
}();

/// Which cells along each axis hold particles of a tile: bit n for cell n of its stack.
struct OccupiedCells {
  std::uint16_t axis[3] = {0, 0, 0};
  static_assert(kStackHeight <= 16);

  void mark(const CellInStack& cell) {
    const int at[3] = {cell.x, cell.y, cell.z};
    for (int a = 0; a < 3; ++a) axis[a] = static_cast<std::uint16_t>(axis[a] | 1U << at[a]);
  }
};

/// One number for each cell of each tile, and one for particles without tile, of each share of the particles.
class CellCounts {
 public:
  CellCounts(std::size_t tiles, std::size_t shares)
      : shares_(shares), of_cell_(tiles * kStackCells * shares, 0U), alone_(shares, 0U) {}

  [[nodiscard]] std::size_t shares() const { return shares_; }
  [[nodiscard]] std::uint32_t& of(std::size_t tile, std::uint32_t cell, std::size_t share) {
    return of_cell_[(tile * kStackCells + cell) * shares_ + share];
  }
  [[nodiscard]] std::uint32_t of(std::size_t tile, std::uint32_t cell, std::size_t share) const {
    return of_cell_[(tile * kStackCells + cell) * shares_ + share];
  }
  [[nodiscard]] std::uint32_t& alone(std::size_t share) { return alone_[share]; }
  [[nodiscard]] std::size_t bytes() const { return of_cell_.capacity() * sizeof(std::uint32_t); }

 private:
  std::size_t shares_;
  std::vector<std::uint32_t> of_cell_;
  std::vector<std::uint32_t> alone_;
};

}  // namespace breccia::grid

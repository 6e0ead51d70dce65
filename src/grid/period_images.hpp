// Blocks beyond the period of an axis along columns: a column goes on there, though its nodes are those of the other
// end. What is added to them goes to the nodes of the period before the grid update, and velocities come back after it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "grid/blocks.hpp"
#include "grid/node_columns.hpp"
#include "grid/tile.hpp"

namespace breccia::grid {

class PeriodImages {
 public:
  struct Image {
    std::uint32_t block;
    std::uint32_t original;  ///< in the period
  };

  /// Finds those of the blocks `owned` of the table; `shared(image)`: whether they are updated before the rest.
  template <class Shared>
  void find(const BlockTable& blocks, std::size_t owned, const Periodicity& periodicity, Shared&& shared) {
    shared_.clear();
    rest_.clear();
    for (std::uint32_t b = 0; periodicity.blocks[2] != 0 && b < owned; ++b) {
      const BlockCoord here = block_coord(blocks.keys()[b]);
      const BlockCoord there = periodicity.wrap(here);
      if (there == here) continue;
      const Image image{b, blocks.find(block_key(there))};
      (shared(image) ? shared_ : rest_).push_back(image);
    }
  }
  [[nodiscard]] bool empty() const { return shared_.empty() && rest_.empty(); }
  [[nodiscard]] std::span<const Image> shared() const { return shared_; }
  [[nodiscard]] std::span<const Image> rest() const { return rest_; }

  /// Moves the sums of images to their originals, and their marks.
  template <class Real>
  static void fold(std::span<const Image> images, const NodeColumns& columns, Real* sums, RowMask* rows);

 private:
  std::vector<Image> shared_, rest_;
};

}  // namespace breccia::grid

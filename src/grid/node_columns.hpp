// Where the nodes of blocks lie in memory: in columns along z. Blocks above each other share their sixteen columns, so
// that the nodes of a stencil along z follow each other wherever it lies, and particles read and add to them in place.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "grid/layout.hpp"

namespace breccia::grid {

/// Where a block lies. Places are counted in nodes; the columns of a run of blocks above each other follow each other.
struct BlockPlace {
  std::uint32_t first = 0;   ///< place of the block's first node in the column (0, 0)
  std::uint32_t height = 0;  ///< places from one column to the next, y fastest

  [[nodiscard]] constexpr std::uint32_t node(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return first + (kBlockWidth * x + y) * height + z;
  }
  /// Of node n of the block, 16 x + 4 y + z.
  [[nodiscard]] constexpr std::uint32_t node(std::uint32_t n) const { return node(n / 16, n / 4 % 4, n % 4); }
};

class NodeColumns {
 public:
  /// Gives places to the nodes of blocks: the places of block i are those of keys[i].
  void lay_out(std::span<const BlockKey> keys);
  /// Appends `count` blocks above each other, apart from all others: theirs are the next indices.
  void append_run(int count);

  [[nodiscard]] std::span<const BlockPlace> blocks() const { return blocks_; }
  /// Places in all; some beyond the last column, so that a load of four nodes may begin at any.
  [[nodiscard]] std::size_t places() const { return std::size_t{end_} + kBeyond; }

 private:
  static constexpr std::uint32_t height_of(std::uint32_t blocks) {
    // No two columns of a stencil shall lie 4096 bytes apart: that makes loads wait for stores they have nothing to do
    // with. Pairs of nodes remain a line of the cache.
    const std::uint32_t gap = blocks % 4 == 0 ? 2 : 0;
    return blocks * kBlockWidth + gap;
  }
  static constexpr std::uint32_t kBefore = 20;  ///< a tile counts from its lowest node, whether it exists or not
  static constexpr std::uint32_t kBeyond = 4;

  std::vector<BlockPlace> blocks_;
  std::uint32_t end_ = kBefore;
};

}  // namespace breccia::grid

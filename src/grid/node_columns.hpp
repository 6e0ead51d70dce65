// Where the nodes of blocks lie in memory: in columns along z. Blocks above each other share their sixteen columns, so
// that the nodes of a stencil along z follow each other wherever it lies, and particles read and add to them in place.
#pragma once

#include <cstddef>
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

/// Heights and first places are even: pairs of nodes are lines of the cache.
class NodeColumns {
 public:
  /// Places before the first column: a tile counts from its lowest node, whether that exists or not.
  static constexpr std::uint32_t kBefore = 20;
  /// Places beyond the last column, so that a load of four nodes may begin at any.
  static constexpr std::uint32_t kBeyond = 4;

  /// `node_bytes`: of the sums of a node.
  explicit NodeColumns(std::size_t node_bytes) : node_bytes_(node_bytes) {}

  /// Gives places to the nodes of blocks: the places of block i are those of keys[i]. Throws NumericsError beyond 2^31
  /// places.
  void lay_out(std::span<const BlockKey> keys);
  /// Appends `count` blocks above each other, apart from all others: theirs are the next indices. Throws as lay_out.
  void append_run(int count);

  [[nodiscard]] std::span<const BlockPlace> blocks() const { return blocks_; }
  [[nodiscard]] std::size_t places() const { return std::size_t{end_} + kBeyond; }

  /// Calls visit(indices) for the blocks laid out that share their columns.
  template <class F>
  void for_each_run(F&& visit) const {
    std::size_t first = 0;
    for (const std::size_t last : run_ends_) {
      visit(std::span(in_order_).subspan(first, last - first));
      first = last;
    }
  }

 private:
  [[nodiscard]] std::uint32_t height_of(std::size_t blocks) const;
  // The columns of so many blocks at the end.
  [[nodiscard]] BlockPlace add_columns(std::size_t blocks);

  std::size_t node_bytes_;
  std::vector<BlockPlace> blocks_;
  std::vector<std::uint32_t> in_order_;  // of keys
  std::vector<std::size_t> run_ends_;    // in in_order_
  std::uint32_t end_ = kBefore;
};

}  // namespace breccia::grid

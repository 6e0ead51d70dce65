// The sparse, unbounded background grid: blocks of 4x4x4 nodes found by 64-bit keys, and the tiles that scatter to
// them.
#pragma once

#include <cstdint>
#include <vector>

#include "grid/layout.hpp"

namespace breccia::grid {

/// Blocks of this rank in the order of their storage, found by key in constant time.
class BlockTable {
 public:
  void clear();
  /// Index of the block, added at the end if it is new.
  std::uint32_t insert(BlockKey key);
  /// Index of the block or kNoBlock.
  [[nodiscard]] std::uint32_t find(BlockKey key) const;
  [[nodiscard]] std::size_t size() const { return keys_.size(); }
  [[nodiscard]] const std::vector<BlockKey>& keys() const { return keys_; }

 private:
  [[nodiscard]] std::size_t slot(BlockKey key) const;
  void grow();

  std::vector<BlockKey> keys_;
  std::uint32_t last_ = 0;            ///< inserted last: particles that follow each other mostly share a block
  std::vector<std::uint32_t> slots_;  ///< open addressing, index + 1, 0 = free
};

}  // namespace breccia::grid

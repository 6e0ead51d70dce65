// The sparse, unbounded background grid: blocks of 4x4x4 nodes found by 64-bit keys, and the tiles that scatter to
// them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "grid/layout.hpp"

namespace breccia::grid {

/// One of 2^bits places for a key, of two at least. Fibonacci hashing: only the highest bits of the product hang on all
/// of the key.
constexpr std::size_t key_hash(BlockKey key, unsigned bits) { return key * 0x9E3779B97F4A7C15ULL >> (64 - bits); }

/// Blocks of this rank in the order of their storage, found by key in constant time.
class BlockTable {
 public:
  void clear();
  /// Makes room for so many blocks.
  void reserve(std::size_t blocks);
  /// Index of the block, added at the end if it is new.
  std::uint32_t insert(BlockKey key);
  /// Index of the block or kNoBlock.
  [[nodiscard]] std::uint32_t find(BlockKey key) const;
  [[nodiscard]] std::size_t size() const { return keys_.size(); }
  [[nodiscard]] const std::vector<BlockKey>& keys() const { return keys_; }

 private:
  [[nodiscard]] std::size_t slot(BlockKey key) const;
  void grow(std::size_t slots);

  std::vector<BlockKey> keys_;
  /// Inserted last, one for each remainder of keys: particles that follow each other mostly lie in one block or in two
  /// above each other.
  std::array<std::uint32_t, 2> last_{};
  std::vector<std::uint32_t> slots_;  ///< open addressing, index + 1, 0 = free
};

}  // namespace breccia::grid

// The sparse, unbounded background grid: blocks of 4x4x4 nodes found by 64-bit keys, and the tiles that scatter to
// them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "grid/tile.hpp"

namespace breccia::grid {

/// Block coordinates: node coordinates divided by 4, rounded down.
struct BlockCoord {
  std::int32_t x, y, z;
  friend bool operator==(const BlockCoord&, const BlockCoord&) = default;
};

/// Largest block coordinate a key can hold (21 bits an axis): 4 million cells from the origin.
inline constexpr std::int32_t kBlockLimit = (1 << 20) - 2;

/// Keys sort by x, then y, then z.
using BlockKey = std::uint64_t;

constexpr BlockKey block_key(BlockCoord b) {
  constexpr std::int32_t bias = 1 << 20;
  return (static_cast<BlockKey>(b.x + bias) << 42) | (static_cast<BlockKey>(b.y + bias) << 21) |
         static_cast<BlockKey>(b.z + bias);
}

constexpr BlockCoord block_coord(BlockKey key) {
  constexpr std::int32_t bias = 1 << 20;
  constexpr BlockKey mask = (1U << 21) - 1;
  return {static_cast<std::int32_t>((key >> 42) & mask) - bias, static_cast<std::int32_t>((key >> 21) & mask) - bias,
          static_cast<std::int32_t>(key & mask) - bias};
}

constexpr std::int32_t component(BlockCoord b, int axis) { return axis == 0 ? b.x : axis == 1 ? b.y : b.z; }

/// Number of blocks after which an axis repeats; 0: it does not.
struct Periodicity {
  std::array<std::int32_t, 3> blocks{0, 0, 0};

  [[nodiscard]] std::int32_t wrap(std::int32_t b, int axis) const {
    const std::int32_t n = blocks[static_cast<std::size_t>(axis)];
    if (n == 0) return b;
    const std::int32_t r = b % n;
    return r < 0 ? r + n : r;
  }
  [[nodiscard]] BlockCoord wrap(BlockCoord b) const { return {wrap(b.x, 0), wrap(b.y, 1), wrap(b.z, 2)}; }
};

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

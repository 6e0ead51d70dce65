// How the background grid is cut into blocks, tiles and keys: shared by the engines of all devices.
#pragma once

#include <array>
#include <cstdint>

namespace breccia::grid {

inline constexpr int kBlockWidth = 4;  ///< nodes along an edge of a block
inline constexpr int kBlockNodes = 64;
inline constexpr int kTileMargin = 2;  ///< stencil (1) and drift between two sortings (1)
inline constexpr int kTileWidth = kBlockWidth + 2 * kTileMargin;
inline constexpr int kNodeBias = 8;  ///< keeps the 8-bit tile coordinates positive
inline constexpr std::uint32_t kNoBlock = 0xffffffffU;

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

  [[nodiscard]] constexpr std::int32_t wrap(std::int32_t b, int axis) const {
    const std::int32_t n = blocks[static_cast<std::size_t>(axis)];
    if (n == 0) return b;
    const std::int32_t r = b % n;
    return r < 0 ? r + n : r;
  }
  [[nodiscard]] constexpr BlockCoord wrap(BlockCoord b) const { return {wrap(b.x, 0), wrap(b.y, 1), wrap(b.z, 2)}; }
};

}  // namespace breccia::grid

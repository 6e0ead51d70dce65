// Cubic blocks of space and their numbers, on host and device.
#pragma once

#include <cstdint>

#include "breccia/linalg.hpp"

namespace breccia::gravity {

struct BlockIndex {
  std::int32_t x, y, z;

  friend BRECCIA_HD bool operator==(BlockIndex a, BlockIndex b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
  friend bool operator<(BlockIndex a, BlockIndex b) {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
  }
};

BRECCIA_HD std::uint64_t hash_of(BlockIndex index) {
  std::uint64_t h = static_cast<std::uint32_t>(index.x) * 0x9e3779b97f4a7c15ULL;
  h = (h ^ (h >> 32) ^ static_cast<std::uint32_t>(index.y)) * 0xbf58476d1ce4e5b9ULL;
  h = (h ^ (h >> 29) ^ static_cast<std::uint32_t>(index.z)) * 0x94d049bb133111ebULL;
  return h ^ (h >> 31);
}

/// The coordinate of a block; beyond 2e9 blocks from the origin all are the last one.
BRECCIA_HD std::int32_t block_coordinate(double x, double per_width) {
  constexpr double kLast = 2e9;
  const double scaled = per_width * x;
  const double within = scaled < -kLast ? -kLast : scaled > kLast ? kLast : scaled;
  const auto towards_zero = static_cast<std::int32_t>(within);
  return towards_zero - (within < towards_zero ? 1 : 0);
}

/// Of position p; blocks have 1/per_width [m].
BRECCIA_HD BlockIndex block_of(Vec3d p, double per_width) {
  return {block_coordinate(p.x, per_width), block_coordinate(p.y, per_width), block_coordinate(p.z, per_width)};
}

/// A block and the 26 around it: n from 0 to 26.
inline constexpr int kBlocksAround = 27;
BRECCIA_HD BlockIndex block_around(BlockIndex b, int n) {
  return {b.x + n / 9 - 1, b.y + n / 3 % 3 - 1, b.z + n % 3 - 1};
}

}  // namespace breccia::gravity

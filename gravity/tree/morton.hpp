// 63-bit Morton keys: 21 bits per axis of a root cube, so that cells of an octree are ranges of sorted keys.
#pragma once

#include <cstdint>

#include "breccia/linalg.hpp"
#include "breccia/macros.hpp"

namespace breccia::gravity {

inline constexpr int kKeyBitsPerAxis = 21;
inline constexpr int kKeyBits = 3 * kKeyBitsPerAxis;

/// The cube that holds all particles. Inside, lengths count in `unit`, a power of two near side/1024, which keeps the
/// fifth power of any distance within float range and costs no rounding.
struct Root {
  Vec3d corner{};     ///< [m]
  double side = 1.0;  ///< [m]
  double unit = 1.0;  ///< [m]

  [[nodiscard]] BRECCIA_HD Vec3d scaled(Vec3d x) const { return (1.0 / unit) * (x - corner); }
};

/// Bits 0..20 of `x` to every third bit.
BRECCIA_HD std::uint64_t spread_bits(std::uint64_t x) {
  x = (x | (x << 32)) & 0x001f00000000ffffULL;
  x = (x | (x << 16)) & 0x001f0000ff0000ffULL;
  x = (x | (x << 8)) & 0x100f00f00f00f00fULL;
  x = (x | (x << 4)) & 0x10c30c30c30c30c3ULL;
  return (x | (x << 2)) & 0x1249249249249249ULL;
}

/// Key of scaled coordinates in [0, side/unit].
BRECCIA_HD std::uint64_t morton_key(Vec3d scaled, double cells_per_unit) {
  constexpr std::int64_t kLast = (std::int64_t{1} << kKeyBitsPerAxis) - 1;
  const double coordinates[3] = {scaled.x, scaled.y, scaled.z};
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    auto cell = static_cast<std::int64_t>(coordinates[axis] * cells_per_unit);
    cell = cell < 0 ? 0 : (cell > kLast ? kLast : cell);
    key |= spread_bits(static_cast<std::uint64_t>(cell)) << (2 - axis);
  }
  return key;
}

}  // namespace breccia::gravity

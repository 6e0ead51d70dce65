// Precision policies: what is stored and computed in which type (physics.md 4 and 9.9).
#pragma once

#include <cstdint>

#include "breccia/math.hpp"
#include "breccia/pack.hpp"

namespace breccia {

/// float arithmetic; positions as cell + 32-bit fixed point, volume and energy as two floats.
struct MixedPrecision {
  using Real = float;
  static constexpr int kLanes = 16;
  using RealPack = Pack<float, kLanes>;
  using IntPack = Pack<std::int32_t, kLanes>;
  /// Position inside the cell, in units of 2^-32 cells from the node.
  using Offset = std::int32_t;
  static constexpr const char* kName = "mixed";
};

/// double everywhere; the position inside the cell is a double too.
struct DoublePrecision {
  using Real = double;
  static constexpr int kLanes = 8;
  using RealPack = Pack<double, kLanes>;
  using IntPack = Pack<std::int32_t, kLanes>;
  using Offset = double;
  static constexpr const char* kName = "double";
};

}  // namespace breccia

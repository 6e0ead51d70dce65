// Sums over sources with one target per lane, whatever the law of the pair. For kernel files only: one copy per
// instruction set.
//
// Coordinates are relative to the group of targets, so float resolves them; where a group is large against the distance
// of its closest particles (kLow), a second float holds what the first lacks.
#pragma once

#include <cstdint>
#include <type_traits>

#include "breccia/pack.hpp"
#include "gravity/pair_law.hpp"
#include "gravity/rsqrt.hpp"

namespace breccia::gravity::BRECCIA_ISA {

/// Sources summed in Real before the sum goes to double: few enough to keep float rounding, enough to make the
/// conversion free, and their arrays fit the first-level cache.
inline constexpr std::int64_t kSourceBlock = 256;

/// Plummer-softened Newton: q^3 and q with q = 1/sqrt(d^2 + softening^2). Guarded, pairs closer than can be told from
/// coincident count nothing; unguarded, the softening must keep q^3 finite.
template <class V, bool kGuarded>
struct NewtonPair {
  V softening_squared;
  V coincident_squared;

  /// r2 = d^2 + softening_squared.
  BRECCIA_HD PairWeight<V> operator()(V r2) const {
    V q = rsqrt(r2);
    if constexpr (kGuarded) q = select(r2 <= coincident_squared, V{}, q);
    return newton_pair(q);
  }
};

/// Coordinates and masses of sources or targets, one array per component; `low` is not read unless kLow.
template <class Real>
struct Relative {
  const Real* high[3];
  const Real* low[3];
  const Real* mass;
};

/// Sums of one register of targets.
template <class V>
struct PairSums {
  Vec3<V> acceleration{};
  V potential{};
};

/// True in the lane that is the source itself: lane == offset.
template <class V>
BRECCIA_HD typename V::Mask lane_is(std::int64_t offset) {
  using Lanes = typename V::Mask::Vector;
  using Int = std::remove_cvref_t<decltype(Lanes{}[0])>;
  Lanes lanes{};
  for (int l = 0; l < V::kLanes; ++l) lanes[l] = static_cast<Int>(l);
  return {lanes == static_cast<Int>(offset)};
}

template <class V, bool kLow>
BRECCIA_HD V separation(const Relative<typename V::Scalar>& sources, int axis, std::int64_t j, V high, V low) {
  const V d = V(sources.high[axis][j]) - high;
  if constexpr (kLow) {
    return d + (V(sources.low[axis][j]) - low);
  } else {
    return d;
  }
}

/// One register of targets from `i` against sources [begin, end). With kSelf, source j is target j and left out of
/// its own sum.
template <class V, bool kLow, bool kPotential, bool kSelf, class Pair>
BRECCIA_HD PairSums<V> sum_pairs_of(const Relative<typename V::Scalar>& targets, std::int64_t i,
                                    const Relative<typename V::Scalar>& sources, std::int64_t begin, std::int64_t end,
                                    const Pair& pair) {
  V high[3], low[3];
  for (int axis = 0; axis < 3; ++axis) {
    high[axis] = V::load(targets.high[axis] + i);
    low[axis] = kLow ? V::load(targets.low[axis] + i) : V{};
  }
  PairSums<V> sums;
  for (std::int64_t j = begin; j < end; ++j) {
    const V dx = separation<V, kLow>(sources, 0, j, high[0], low[0]);
    const V dy = separation<V, kLow>(sources, 1, j, high[1], low[1]);
    const V dz = separation<V, kLow>(sources, 2, j, high[2], low[2]);
    PairWeight<V> weight = pair(dx * dx + (dy * dy + (dz * dz + pair.softening_squared)));
    if constexpr (kSelf) {
      const auto self = lane_is<V>(j - i);
      weight = {select(self, V{}, weight.force), select(self, V{}, weight.depth)};
    }
    const V mass(sources.mass[j]);
    const V f = mass * weight.force;
    sums.acceleration.x += f * dx;
    sums.acceleration.y += f * dy;
    sums.acceleration.z += f * dz;
    if constexpr (kPotential) sums.potential -= mass * weight.depth;
  }
  return sums;
}

/// Adds a register of Real to doubles.
template <class V>
BRECCIA_HD void add_to(double* sums, V partial) {
  using Doubles = Pack<double, V::kLanes>;
  (Doubles::load(sums) + convert<double>(partial)).store(sums);
}

}  // namespace breccia::gravity::BRECCIA_ISA

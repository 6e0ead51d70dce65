// Sums over the particles in a group's ranges, whatever the law of the pair. For kernel files only.
#pragma once

#include <cstdint>

#include "gravity/tree/interactions.hpp"
#include "gravity/tree/pair_loop.hpp"

namespace breccia::gravity::BRECCIA_ISA {

/// Sums of the targets of one group, in double.
struct Sums {
  double* acceleration[3];
  double* potential;

  template <class V>
  BRECCIA_HD void add(std::int64_t i, Vec3<V> a) const {
    add_to(acceleration[0] + i, a.x);
    add_to(acceleration[1] + i, a.y);
    add_to(acceleration[2] + i, a.z);
  }
};

/// Coordinates relative to `centre` of particles [begin, end), written from `to` on; `stride` apart by component.
template <class Real>
void copy_relative(const MassArrays& from, std::int64_t begin, std::int64_t end, Vec3d centre, Real* to,
                   std::int64_t stride, bool low) {
  const double origin[3] = {centre.x, centre.y, centre.z};
  for (int axis = 0; axis < 3; ++axis) {
    const double* x = from.position[axis] + begin;
    Real* high = to + axis * stride;
    const double o = origin[axis];
    for (std::int64_t k = 0; k < end - begin; ++k) high[k] = static_cast<Real>(x[k] - o);
    if (!low) continue;
    Real* rest = to + (3 + axis) * stride;
    for (std::int64_t k = 0; k < end - begin; ++k) {
      rest[k] = static_cast<Real>((x[k] - o) - static_cast<double>(high[k]));
    }
  }
}

template <class Real>
Relative<Real> relative(const Real* first, std::int64_t stride, const Real* mass) {
  return {
      {first, first + stride, first + 2 * stride}, {first + 3 * stride, first + 4 * stride, first + 5 * stride}, mass};
}

template <class V, bool kLow, bool kPotential, bool kSelf, class Pair>
void add_sources(const Relative<typename V::Scalar>& targets, std::int64_t padded,
                 const Relative<typename V::Scalar>& sources, std::int64_t first, std::int64_t last, const Pair& pair,
                 const Sums& sums) {
  for (std::int64_t begin = first; begin < last; begin += kSourceBlock) {
    const std::int64_t end = begin + kSourceBlock < last ? begin + kSourceBlock : last;
    for (std::int64_t i = 0; i < padded; i += V::kLanes) {
      const PairSums<V> s = sum_pairs_of<V, kLow, kPotential, kSelf>(targets, i, sources, begin, end, pair);
      sums.add(i, s.acceleration);
      if constexpr (kPotential) add_to(sums.potential + i, s.potential);
    }
  }
}

/// All sources in the ranges of `task`, under the law `pair` (see NewtonPair). `memory`: 7 Reals for each source.
template <class V, bool kLow, bool kPotential, class Pair>
void add_ranges(const GroupTask<typename V::Scalar>& task, const Relative<typename V::Scalar>& targets,
                std::int64_t padded, typename V::Scalar* memory, const Pair& pair, const Sums& sums) {
  using Real = typename V::Scalar;
  std::int64_t total = 0;
  for (std::int64_t r = 0; r < task.range_count; ++r) total += task.ranges[r].end - task.ranges[r].begin;
  Real* mass = memory + 6 * total;
  std::int64_t at = 0;
  for (std::int64_t r = 0; r < task.range_count; ++r) {
    const Range range = task.ranges[r];
    copy_relative(task.sources, range.begin, range.end, task.centre, memory + at, total, kLow);
    for (std::int64_t j = range.begin; j < range.end; ++j) mass[at++] = static_cast<Real>(task.sources.mass[j]);
  }
  const Relative<Real> sources = relative<Real>(memory, total, mass);
  std::int64_t others = 0;
  // Without the potential, a particle adds exactly zero to itself.
  if constexpr (kPotential) {
    if (task.self) {
      others = task.end - task.begin;
      add_sources<V, kLow, kPotential, true>(targets, padded, sources, 0, others, pair, sums);
    }
  }
  add_sources<V, kLow, kPotential, false>(targets, padded, sources, others, total, pair, sums);
}

}  // namespace breccia::gravity::BRECCIA_ISA

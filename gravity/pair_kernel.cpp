#include "gravity/pair_kernel.hpp"

#include <type_traits>

#include "breccia/pack.hpp"
#include "gravity/pair_law.hpp"
#include "gravity/rsqrt.hpp"

namespace breccia::gravity::BRECCIA_ISA {
namespace {

// Sources summed in Real before the sum goes to double: few enough to keep float sums at float rounding, enough to
// make the conversion free. Their arrays stay in the first-level cache for a group of targets.
constexpr std::int64_t kSourceBlock = 256;

// Subtracting zero is exact and vanishes, adding it (the pack's own broadcast) is an instruction: -0 + 0 is +0.
template <class V>
BRECCIA_HD V broadcast(typename V::Scalar s) {
  return V(s - typename V::Vector{});
}

template <class V>
BRECCIA_HD V difference(const PointArrays<typename V::Scalar>& sources, int axis, std::int64_t j, V high, V low) {
  const V d = broadcast<V>(sources.high[axis][j]) - high;
  if constexpr (std::is_same_v<typename V::Scalar, float>) {
    return d + (broadcast<V>(sources.low[axis][j]) - low);
  } else {
    return d;
  }
}

// True in the lane whose target is the source itself: lane == j - i.
template <class V>
BRECCIA_HD typename V::Mask is_self(std::int64_t offset) {
  using Lanes = typename V::Mask::Vector;
  using Int = std::remove_cvref_t<decltype(Lanes{}[0])>;
  Lanes lanes{};
  for (int l = 0; l < V::kLanes; ++l) lanes[l] = static_cast<Int>(l);
  return {lanes == static_cast<Int>(offset)};
}

template <class V>
BRECCIA_HD void add_to(double* sums, V partial) {
  for (int l = 0; l < V::kLanes; ++l) sums[l] += static_cast<double>(partial[l]);
}

// One register of targets from i against the sources [begin, end). kGuarded leaves out (i, i) and, without softening,
// coincident pairs; unguarded, a coincident pair adds exactly zero force because d = 0 and q is finite.
template <class V, bool kGuarded, bool kPotential>
void sum_block(const PairTask<typename V::Scalar>& task, std::int64_t i, std::int64_t begin, std::int64_t end) {
  using Real = typename V::Scalar;
  V high[3], low[3];
  for (int axis = 0; axis < 3; ++axis) {
    high[axis] = V::load(task.targets.high[axis] + i);
    low[axis] = std::is_same_v<Real, float> ? V::load(task.targets.low[axis] + i) : V{};
  }
  const V softening_squared = broadcast<V>(task.softening_squared);
  V ax{}, ay{}, az{}, potential{};
  for (std::int64_t j = begin; j < end; ++j) {
    const V dx = difference(task.sources, 0, j, high[0], low[0]);
    const V dy = difference(task.sources, 1, j, high[1], low[1]);
    const V dz = difference(task.sources, 2, j, high[2], low[2]);
    const V r2 = dx * dx + (dy * dy + (dz * dz + softening_squared));
    V q = rsqrt(r2);
    if constexpr (kGuarded) {
      const auto left_out =
          (r2 <= broadcast<V>(kCoincidentPair<Real>)) | is_self<V>(task.same ? j - i : std::int64_t{-1});
      q = select(left_out, V{}, q);
    }
    const V mq = broadcast<V>(task.sources.mass[j]) * q;
    const V f = mq * (q * q);
    ax += f * dx;
    ay += f * dy;
    az += f * dz;
    if constexpr (kPotential) potential -= mq;
  }
  add_to(task.acceleration[0] + i, ax);
  add_to(task.acceleration[1] + i, ay);
  add_to(task.acceleration[2] + i, az);
  if constexpr (kPotential) add_to(task.potential + i, potential);
}

template <class V, bool kGuarded, bool kPotential>
void sum_all(const PairTask<typename V::Scalar>& task) {
  for (std::int64_t begin = 0; begin < task.sources.count; begin += kSourceBlock) {
    const std::int64_t end = begin + kSourceBlock < task.sources.count ? begin + kSourceBlock : task.sources.count;
    for (std::int64_t i = task.begin; i < task.end; i += V::kLanes) {
      sum_block<V, kGuarded, kPotential>(task, i, begin, end);
    }
  }
}

template <class Real>
void sum_as(const PairTask<Real>& task) {
  using V = RegisterPack<Real>;
  const bool with_potential = task.potential != nullptr;
  const bool guarded = task.softening_squared <= kCoincidentPair<Real> || (task.same && with_potential);
  if (guarded) {
    with_potential ? sum_all<V, true, true>(task) : sum_all<V, true, false>(task);
  } else {
    with_potential ? sum_all<V, false, true>(task) : sum_all<V, false, false>(task);
  }
}

}  // namespace

void sum_pairs(const PairTask<float>& task) { sum_as(task); }
void sum_pairs(const PairTask<double>& task) { sum_as(task); }

}  // namespace breccia::gravity::BRECCIA_ISA

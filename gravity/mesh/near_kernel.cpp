// Short-range pair sums: for each cluster of targets, the clusters whose boxes come within the cutoff are found in the
// columns around it, their particles within the cutoff of the targets' box are packed into a list, and every target
// sums over the list. Two thirds of the pairs a cluster-against-cluster loop would evaluate never arise.
#include <cmath>

#include "breccia/pack.hpp"
#include "gravity/mesh/lanes.hpp"
#include "gravity/mesh/mesh_kernels.hpp"
#include "gravity/rsqrt.hpp"

namespace breccia::gravity::BRECCIA_ISA {
namespace {

// Sources worked off at a time; the list stays in the first-level cache and the sums short.
constexpr int kListLength = 1024;

// Room for rounding in the choice of sources; the pair loop itself ends at the cutoff.
constexpr double kSlack = 1e-3;

/// Sources in coordinates from the centre of the target cluster.
template <class Real>
struct SourceList {
  int count = 0;
  Real x[kListLength + 2 * kClusterSize], y[kListLength + 2 * kClusterSize], z[kListLength + 2 * kClusterSize],
      mass[kListLength + 2 * kClusterSize];
};

template <class V>
BRECCIA_HD V broadcast(typename V::Scalar s) {
  return V(s - typename V::Vector{});
}

template <class V>
BRECCIA_HD V beyond(V distance, V half) {
  return max(max(distance, -distance) - half, V{});
}

template <class Real>
struct TargetBox {
  Real centre[3], half[3];
  Real reach_squared;
};

template <class Real>
BRECCIA_HD TargetBox<Real> box_of(const NearTask<Real>& task, std::int64_t cluster) {
  TargetBox<Real> box;
  for (int axis = 0; axis < 3; ++axis) {
    box.centre[axis] = task.targets.centre[axis][cluster];
    box.half[axis] = task.targets.half[axis][cluster];
  }
  const Real reach = std::sqrt(task.law->cutoff_squared) + Real(kSlack);
  box.reach_squared = reach * reach;
  return box;
}

// Adds the particles of a source cluster that come within the cutoff of the target box.
template <class Real>
BRECCIA_HD void append(const NearTask<Real>& task, const TargetBox<Real>& box, std::int64_t cluster,
                       SourceList<Real>& list) {
  using V = RegisterPack<Real>;
  Real shift[3];
  for (int axis = 0; axis < 3; ++axis) shift[axis] = task.sources.centre[axis][cluster] - box.centre[axis];
  for (std::int64_t l = 0; l < kClusterSize; l += V::kLanes) {
    const std::int64_t slot = cluster * kClusterSize + l;
    const V x = V::load(task.sources.offset[0] + slot) + broadcast<V>(shift[0]);
    const V y = V::load(task.sources.offset[1] + slot) + broadcast<V>(shift[1]);
    const V z = V::load(task.sources.offset[2] + slot) + broadcast<V>(shift[2]);
    const V mass = V::load(task.sources.mass + slot);
    const V dx = beyond(x, broadcast<V>(box.half[0]));
    const V dy = beyond(y, broadcast<V>(box.half[1]));
    const V dz = beyond(z, broadcast<V>(box.half[2]));
    const unsigned chosen = bits((dx * dx + (dy * dy + dz * dz) < broadcast<V>(box.reach_squared)) & (mass > V{}));
    store_selected(chosen, x, list.x + list.count);
    store_selected(chosen, y, list.y + list.count);
    store_selected(chosen, z, list.z + list.count);
    store_selected(chosen, mass, list.mass + list.count);
    list.count += __builtin_popcount(chosen);
  }
}

template <class Real, int kDegree, bool kGuarded, bool kPotential>
struct PairLoop {
  using V = RegisterPack<Real>;
  const NearTask<Real>& task;

  BRECCIA_HD void sum_over(const SourceList<Real>& list, std::int64_t slot) const {
    const ShortRangePair<kDegree, V, Real> law(*task.law);
    const V tx = V::load(task.targets.offset[0] + slot);
    const V ty = V::load(task.targets.offset[1] + slot);
    const V tz = V::load(task.targets.offset[2] + slot);
    const V softening_squared = broadcast<V>(task.law->softening_squared);
    const V cutoff_squared = broadcast<V>(task.law->cutoff_squared);
    V ax{}, ay{}, az{}, potential{};
    for (int j = 0; j < list.count; ++j) {
      const V dx = broadcast<V>(list.x[j]) - tx;
      const V dy = broadcast<V>(list.y[j]) - ty;
      const V dz = broadcast<V>(list.z[j]) - tz;
      const V rho2 = dx * dx + (dy * dy + (dz * dz + softening_squared));
      V q = rsqrt(rho2);
      if constexpr (kGuarded) q = select(rho2 <= broadcast<V>(kCoincidentSquared<Real>), V{}, q);
      const auto inside = rho2 < cutoff_squared;
      const V mass = select(inside, broadcast<V>(list.mass[j]), V{});
      const V f = mass * law.force(rho2, q);
      ax += f * dx;
      ay += f * dy;
      az += f * dz;
      if constexpr (kPotential) potential -= mass * law.potential(rho2, q);
    }
    add(task.result[0] + slot, ax);
    add(task.result[1] + slot, ay);
    add(task.result[2] + slot, az);
    if constexpr (kPotential) add(task.result[3] + slot, potential);
  }

  static BRECCIA_HD void add(Real* to, V value) { (V::load(to) + value).store(to); }

  void work_off(SourceList<Real>& list, std::int64_t cluster) const {
    for (std::int64_t l = 0; l < kClusterSize; l += V::kLanes) sum_over(list, cluster * kClusterSize + l);
    task.pairs[cluster] += list.count;
    list.count = 0;
  }

  // The clusters [first, last) of one column.
  BRECCIA_HD void search_column(const TargetBox<Real>& box, std::int64_t first, std::int64_t last, std::int64_t cluster,
                                SourceList<Real>& list) const {
    for (std::int64_t c = first; c < last; c += V::kLanes) {
      V distance2{};
      for (int axis = 0; axis < 3; ++axis) {
        const V d = V::load(task.sources.centre[axis] + c) - broadcast<V>(box.centre[axis]);
        const V gap = beyond(d, V::load(task.sources.half[axis] + c) + broadcast<V>(box.half[axis]));
        distance2 += gap * gap;
      }
      unsigned chosen = bits(distance2 < broadcast<V>(box.reach_squared));
      if (last - c < V::kLanes) chosen &= (1U << (last - c)) - 1U;
      for (; chosen != 0; chosen &= chosen - 1) {
        append(task, box, c + __builtin_ctz(chosen), list);
        if (list.count >= kListLength) work_off(list, cluster);
      }
    }
  }

  void run() const {
    SourceList<Real> list;
    const ClusterColumns& columns = task.columns;
    for (std::int64_t cluster = task.begin; cluster < task.end; ++cluster) {
      const TargetBox<Real> box = box_of(task, cluster);
      int from[2], to[2];
      for (int axis = 0; axis < 2; ++axis) {
        const double reach = std::sqrt(static_cast<double>(box.reach_squared)) + static_cast<double>(box.half[axis]);
        const double at = static_cast<double>(box.centre[axis]) - columns.low[axis];
        const int most = (axis == 0 ? columns.nx : columns.ny) - 1;
        const double low = (at - reach) / columns.width;
        const double high = (at + reach) / columns.width;
        from[axis] = low <= 0.0 ? 0 : (low >= most + 1 ? most + 1 : static_cast<int>(low));
        to[axis] = high < 0.0 ? -1 : (high >= most ? most : static_cast<int>(high));
      }
      for (int x = from[0]; x <= to[0]; ++x) {
        for (int y = from[1]; y <= to[1]; ++y) {
          const std::int64_t* range = columns.first + static_cast<std::int64_t>(x) * columns.ny + y;
          search_column(box, range[0], range[1], cluster, list);
        }
      }
      if (list.count > 0) work_off(list, cluster);
    }
  }
};

template <class Real, int kDegree>
void sum_degree(const NearTask<Real>& task) {
  const bool potential = task.result[3] != nullptr;
  if (!task.law->counts_self) {
    potential ? PairLoop<Real, kDegree, true, true>{task}.run() : PairLoop<Real, kDegree, true, false>{task}.run();
  } else {
    potential ? PairLoop<Real, kDegree, false, true>{task}.run() : PairLoop<Real, kDegree, false, false>{task}.run();
  }
}

template <class Real>
void sum_as(const NearTask<Real>& task) {
  switch (task.law->degree) {
    case 8:
      return sum_degree<Real, 8>(task);
    case 10:
      return sum_degree<Real, 10>(task);
    default:
      return sum_degree<Real, 12>(task);
  }
}

}  // namespace

void sum_near(const NearTask<float>& task) { sum_as(task); }
void sum_near(const NearTask<double>& task) { sum_as(task); }

}  // namespace breccia::gravity::BRECCIA_ISA

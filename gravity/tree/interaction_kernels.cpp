#include "breccia/pack.hpp"
#include "gravity/rsqrt.hpp"
#include "gravity/tree/group_loop.hpp"
#include "gravity/tree/interactions.hpp"

namespace breccia::gravity::BRECCIA_ISA {
namespace {

template <class V, bool kPotential>
void add_far(const LocalExpansion<double>& far, const Relative<typename V::Scalar>& targets, std::int64_t padded,
             const Sums& sums) {
  using Real = typename V::Scalar;
  LocalExpansion<V> l;
  for_each_coefficient(l, far, [](V& to, double from) BRECCIA_INLINE_LAMBDA { to = V(static_cast<Real>(from)); });
  for (std::int64_t i = 0; i < padded; i += V::kLanes) {
    const Vec3<V> r{V::load(targets.high[0] + i), V::load(targets.high[1] + i), V::load(targets.high[2] + i)};
    const PointField<V> field = evaluate(l, r);
    sums.add(i, field.gradient);
    if constexpr (kPotential) add_to(sums.potential + i, -field.value);
  }
}

// Distant cells at a time: their converted data stays in the first-level cache.
constexpr std::int64_t kCellBlock = 64;

// A cell as seen from an origin: position, mass, second moment.
constexpr int kComponents = 10;
template <class Real>
BRECCIA_HD void convert(const Cell& cell, Vec3d origin, Real* to, int stride) {
  const Vec3d x = cell.centre - origin;
  const Sym3<double>& s = cell.moments.second;
  const double values[kComponents] = {x.x, x.y, x.z, cell.moments.mass, s.xx, s.yy, s.zz, s.xy, s.xz, s.yz};
  for (int c = 0; c < kComponents; ++c) to[c * stride] = static_cast<Real>(values[c]);
}

template <class V, bool kPotential>
void add_cells(const CellRefs& cells, Vec3d centre, const Relative<typename V::Scalar>& targets, std::int64_t padded,
               V softening_squared, const Sums& sums) {
  using Real = typename V::Scalar;
  Real block[kCellBlock][kComponents];
  for (std::int64_t begin = 0; begin < cells.count; begin += kCellBlock) {
    const std::int64_t count = begin + kCellBlock < cells.count ? kCellBlock : cells.count - begin;
    for (std::int64_t k = 0; k < count; ++k) convert(cells.all[cells.list[begin + k]], centre, block[k], 1);
    for (std::int64_t i = 0; i < padded; i += V::kLanes) {
      const Vec3<V> r{V::load(targets.high[0] + i), V::load(targets.high[1] + i), V::load(targets.high[2] + i)};
      Vec3<V> acceleration{};
      V potential{};
      for (std::int64_t k = 0; k < count; ++k) {
        const Real* c = block[k];
        const Vec3<V> x{r.x - V(c[0]), r.y - V(c[1]), r.z - V(c[2])};
        const Moments<V> source{V(c[3]), {V(c[4]), V(c[5]), V(c[6]), V(c[7]), V(c[8]), V(c[9])}};
        const PointField<V> field = field_of(source, x, rsqrt(dot(x, x) + softening_squared));
        acceleration += field.gradient;
        if constexpr (kPotential) potential -= field.value;
      }
      sums.add(i, acceleration);
      if constexpr (kPotential) add_to(sums.potential + i, potential);
    }
  }
}

template <class V, bool kLow, bool kPotential>
void add_particles(const GroupTask<typename V::Scalar>& task, const Relative<typename V::Scalar>& targets,
                   std::int64_t padded, typename V::Scalar* memory, const Sums& sums) {
  using Real = typename V::Scalar;
  const V softening_squared(task.softening_squared);
  if (task.softening_squared <= kCoincidentPair<Real>) {
    const NewtonPair<V, true> pair{softening_squared, V(kCoincidentPair<Real>)};
    add_ranges<V, kLow, kPotential>(task, targets, padded, memory, pair, sums);
  } else {
    const NewtonPair<V, false> pair{softening_squared, V{}};
    add_ranges<V, kLow, kPotential>(task, targets, padded, memory, pair, sums);
  }
}

template <class V, bool kPotential>
void evaluate_as(const GroupTask<typename V::Scalar>& task) {
  using Real = typename V::Scalar;
  const std::int64_t count = task.end - task.begin;
  const std::int64_t padded = lane_padded(count);
  const bool low = task.split_coordinates && std::is_same_v<Real, float>;
  for (std::int64_t k = 0; k < 6 * padded; ++k) task.reals[k] = Real(0);
  for (std::int64_t k = 0; k < 4 * padded; ++k) task.doubles[k] = 0.0;
  copy_relative(task.targets, task.begin, task.end, task.centre, task.reals, padded, low);
  const Relative<Real> targets = relative<Real>(task.reals, padded, nullptr);
  const Sums sums{{task.doubles, task.doubles + padded, task.doubles + 2 * padded}, task.doubles + 3 * padded};
  Real* memory = task.reals + 6 * padded;

  if (task.far != nullptr) add_far<V, kPotential>(*task.far, targets, padded, sums);
  add_cells<V, kPotential>(task.cells, task.centre, targets, padded, V(task.softening_squared), sums);
  if (low) {
    if constexpr (std::is_same_v<Real, float>) add_particles<V, true, kPotential>(task, targets, padded, memory, sums);
  } else {
    add_particles<V, false, kPotential>(task, targets, padded, memory, sums);
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (std::int64_t k = 0; k < count; ++k) task.acceleration[axis][task.begin + k] += sums.acceleration[axis][k];
  }
  if constexpr (kPotential) {
    for (std::int64_t k = 0; k < count; ++k) task.potential[task.begin + k] += sums.potential[k];
  }
}

template <class Real>
void evaluate_task(const GroupTask<Real>& task) {
  using V = RegisterPack<Real>;
  task.potential != nullptr ? evaluate_as<V, true>(task) : evaluate_as<V, false>(task);
}

template <class Real>
void expand_task(const ExpansionTask<Real>& task) {
  using V = RegisterPack<Real>;
  LocalExpansion<V> l{};
  for (std::int64_t k = 0; k < task.cells.count; k += V::kLanes) {
    // Lanes without a cell hold no mass, a unit away.
    Real block[kComponents][V::kLanes] = {};
    for (int lane = 0; lane < V::kLanes; ++lane) {
      block[0][lane] = Real(1);
      if (k + lane < task.cells.count) {
        convert(task.cells.all[task.cells.list[k + lane]], task.centre, &block[0][lane], V::kLanes);
      }
    }
    const auto load = [&](int c) BRECCIA_INLINE_LAMBDA { return V::load(block[c]); };
    const Vec3<V> x{-load(0), -load(1), -load(2)};
    const Moments<V> source{load(3), {load(4), load(5), load(6), load(7), load(8), load(9)}};
    add_field_of(source, x, rsqrt(dot(x, x) + V(task.softening_squared)), l);
  }
  for_each_coefficient(*task.expansion, l, [](double& to, V from) BRECCIA_INLINE_LAMBDA {
    to += static_cast<double>(horizontal_sum(from));
  });
}

template <bool kGroup>
void decide_for(const OpeningTask& task) {
  using V = RegisterPack<double>;
  const Cell& target = *task.target;
  for (std::int64_t k = 0; k < task.sources.count; k += V::kLanes) {
    double dx[V::kLanes] = {}, dy[V::kLanes] = {}, dz[V::kLanes] = {}, radius[V::kLanes] = {}, mass[V::kLanes] = {};
    const std::int64_t count = task.sources.count - k < V::kLanes ? task.sources.count - k : V::kLanes;
    for (std::int64_t lane = 0; lane < count; ++lane) {
      const Cell& source = task.sources.all[task.sources.list[k + lane]];
      const Vec3d d = target.centre - source.centre;
      dx[lane] = d.x;
      dy[lane] = d.y;
      dz[lane] = d.z;
      radius[lane] = source.radius;
      mass[lane] = source.moments.mass;
    }
    const Vec3<V> d{V::load(dx), V::load(dy), V::load(dz)};
    const OpeningGeometry<V> g{dot(d, d), V::load(radius), V::load(mass), V(target.radius), V(task.largest_error)};
    double number[V::kLanes];
    if constexpr (kGroup) {
      opening_number(g).store(number);
    } else {
      select(expandable(g), V(static_cast<double>(Opening::kExpand)), V(static_cast<double>(Opening::kOpen)))
          .store(number);
    }
    for (std::int64_t lane = 0; lane < count; ++lane)
      task.how[k + lane] = static_cast<Opening>(static_cast<int>(number[lane]));
  }
}

void decide(const OpeningTask& task) { task.target->is_group() ? decide_for<true>(task) : decide_for<false>(task); }

}  // namespace

template <class Real>
const InteractionKernels<Real>& kernels() {
  static constexpr InteractionKernels<Real> kKernels{evaluate_task<Real>, expand_task<Real>, decide};
  return kKernels;
}
template const InteractionKernels<float>& kernels<float>();
template const InteractionKernels<double>& kernels<double>();

}  // namespace breccia::gravity::BRECCIA_ISA

#include "gravity/mesh/near_field.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "gravity/mesh/mesh_kernels.hpp"

namespace breccia::gravity {
namespace {

constexpr std::int64_t kClusterGroup = 16;

// Box around the particles, grown by `margin`; upside down without any.
Box grown_bounds(std::span<const Vec3d> position, double margin) {
  Box box{{1.0, 1.0, 1.0}, {-1.0, -1.0, -1.0}};
  if (position.empty()) return box;
  box.low = box.high = position[0];
  for (const Vec3d p : position) {
    box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
    box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
  }
  const Vec3d m{margin, margin, margin};
  return {box.low - m, box.high + m};
}

}  // namespace

template <class Real>
double NearField<Real>::add_field(const Clusters<Real>& own, std::span<const Vec3d> position,
                                  std::span<const double> mass, double spacing, const ShortRange<Real>& law,
                                  bool with_potential, SlotField<Real>& field, Phases& phases) {
  pairs_.assign(static_cast<std::size_t>(own.count()), 0);
  phases.time(Phase::kPairs, [&] {
    if (comm_.size() > 1)
      fetch_halo(position, mass, std::sqrt(static_cast<double>(law.cutoff_squared)), spacing, phases);
    add_from(own, own, law, with_potential, field);
    if (halo_.count() > 0) add_from(halo_, own, law, with_potential, field);
  });
  return static_cast<double>(kClusterSize * std::accumulate(pairs_.begin(), pairs_.end(), std::int64_t{0}));
}

// Every rank gets those particles of the others that lie within the cutoff of the box around its own.
template <class Real>
void NearField<Real>::fetch_halo(std::span<const Vec3d> position, std::span<const double> mass, double cutoff,
                                 double spacing, Phases& phases) {
  struct Point {
    Vec3d position;
    double mass;
  };
  const std::vector<Box> boxes = comm_.allgather(grown_bounds(position, cutoff));
  std::vector<std::vector<Point>> to(boxes.size());
  for (std::size_t r = 0; r < boxes.size(); ++r) {
    if (static_cast<int>(r) == comm_.rank()) continue;
    for (std::size_t i = 0; i < position.size(); ++i) {
      if (boxes[r].contains(position[i])) to[r].push_back({position[i], mass[i]});
    }
    phases.bytes_sent += static_cast<double>(to[r].size() * sizeof(Point));
  }
  halo_position_.clear();
  halo_mass_.clear();
  for (const std::vector<Point>& from : comm_.alltoall(to)) {
    for (const Point& p : from) {
      halo_position_.push_back(p.position);
      halo_mass_.push_back(p.mass);
    }
  }
  halo_.build(halo_position_, halo_mass_, spacing, threads_);
}

template <class Real>
void NearField<Real>::add_from(const Clusters<Real>& sources, const Clusters<Real>& own, const ShortRange<Real>& law,
                               bool with_potential, SlotField<Real>& field) {
  const ClusterArrays<Real> targets = own.arrays();
  const ClusterArrays<Real> source_arrays = sources.arrays();
  const ClusterColumns columns = sources.columns();
#pragma omp parallel for num_threads(threads_) schedule(dynamic, 1)
  for (std::int64_t begin = 0; begin < targets.count; begin += kClusterGroup) {
    sum_near(
        NearTask<Real>{targets,
                       begin,
                       std::min(begin + kClusterGroup, targets.count),
                       source_arrays,
                       columns,
                       &law,
                       {field[0].data(), field[1].data(), field[2].data(), with_potential ? field[3].data() : nullptr},
                       pairs_.data()});
  }
}

template class NearField<float>;
template class NearField<double>;

}  // namespace breccia::gravity

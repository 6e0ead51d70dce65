// Clusters of neighbouring particles: columns along z, in each column the particles in the order of z, cut every 16.
// Compact clusters without a tree, with no partly filled ones but at the top of a column.
#pragma once

#include <span>
#include <vector>

#include "breccia/linalg.hpp"
#include "gravity/mesh/aligned.hpp"
#include "gravity/mesh/cluster_arrays.hpp"

namespace breccia::gravity {

template <class Real>
class Clusters {
 public:
  /// Sorts particles at `position` [cells] with `mass`; `spacing` is their mean distance where they are dense [cells].
  /// Equal input gives equal clusters whatever the number of threads.
  void build(std::span<const Vec3d> position, std::span<const double> mass, double spacing, int threads);

  [[nodiscard]] ClusterArrays<Real> arrays() const;
  [[nodiscard]] ClusterColumns columns() const;
  [[nodiscard]] std::int64_t count() const { return first_.empty() ? 0 : first_.back(); }
  /// Slot of particle i.
  [[nodiscard]] const std::vector<std::int64_t>& slots() const { return slots_; }

 private:
  void lay_columns(std::span<const Vec3d> position, double spacing);
  void sort(std::span<const Vec3d> position, int threads);
  void fill_column(std::size_t column, std::span<const Vec3d> position, std::span<const double> mass);
  void fill_cluster(std::size_t cluster, std::span<const std::uint32_t> members, std::span<const Vec3d> position,
                    std::span<const double> mass);

  Vec3d low_{};
  double width_ = 1.0;
  double bin_ = 1.0;  // height of the bins that z is sorted by
  int nx_ = 0, ny_ = 0, bins_ = 0;
  std::vector<std::uint32_t> key_, order_, start_;  // particle -> bin, sorted particles, bin -> first in order_
  std::vector<std::int64_t> first_, slots_;
  AlignedVector<Real> centre_[3], half_[3], offset_[3], mass_;
};

}  // namespace breccia::gravity

// Slabs: the background grid cut on block planes along one axis, each slab owned by one rank. A rank may own nothing.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "mpi/comm.hpp"

namespace breccia::mpi {

/// Work counted on block planes: plane -> work in any unit. Integers: sums do not depend on their order.
using PlaneWork = std::map<std::int32_t, std::uint64_t>;

/// The work of all ranks, on all ranks. Collective.
PlaneWork sum_over_ranks(const PlaneWork& mine, const Comm& comm);

/// Work of all planes together.
std::uint64_t total(const PlaneWork& work);

/// Planes that hold the middle nine tenths of the work: its extent without what flies far off; 0 without work.
std::int64_t extent(const PlaneWork& work);

class Slabs {
 public:
  /// One slab on one rank: owns every plane.
  Slabs() = default;
  /// Slabs as axis() and cuts() of others say.
  Slabs(int axis, std::vector<std::int32_t> cuts) : axis_(axis), cuts_(std::move(cuts)) {}
  /// Cuts the planes so that the rank with the most of `all` has the least that whole planes allow; among such cuts,
  /// those nearest to even shares. Ranks may get nothing. A function of its arguments alone: all ranks find the same.
  static Slabs balanced(int axis, const PlaneWork& all, int ranks);

  [[nodiscard]] int axis() const { return axis_; }
  /// Rank that owns a block plane.
  [[nodiscard]] int owner(std::int32_t plane) const;
  /// First plane of each rank but rank 0; not decreasing. Ranks between two equal cuts own nothing.
  [[nodiscard]] const std::vector<std::int32_t>& cuts() const { return cuts_; }
  /// What each rank has of `all`.
  [[nodiscard]] std::vector<std::uint64_t> shares(const PlaneWork& all) const;

 private:
  int axis_ = 0;
  std::vector<std::int32_t> cuts_;
};

}  // namespace breccia::mpi

// Slabs: the background grid cut on block planes along one axis, each slab owned by one rank. A rank may own nothing.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "mpi/comm.hpp"

namespace breccia::mpi {

/// Work counted on block planes: plane -> particles (or any integer weight).
using PlaneWork = std::map<std::int32_t, std::uint64_t>;

class Slabs {
 public:
  /// One slab on one rank: owns every plane.
  Slabs() = default;
  /// Slabs as axis() and cuts() of others say.
  Slabs(int axis, std::vector<std::int32_t> cuts) : axis_(axis), cuts_(std::move(cuts)) {}
  /// Cuts the planes so that the work is as even as whole planes allow. Collective; `mine` is this rank's share.
  static Slabs balanced(int axis, const PlaneWork& mine, const Comm& comm);

  [[nodiscard]] int axis() const { return axis_; }
  /// Rank that owns a block plane.
  [[nodiscard]] int owner(std::int32_t plane) const;
  /// First plane of each rank but rank 0; not decreasing. Ranks between two equal cuts own nothing.
  [[nodiscard]] const std::vector<std::int32_t>& cuts() const { return cuts_; }

 private:
  int axis_ = 0;
  std::vector<std::int32_t> cuts_;
};

}  // namespace breccia::mpi

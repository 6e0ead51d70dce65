#include "mpi/slabs.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace breccia::mpi {

Slabs Slabs::balanced(int axis, const PlaneWork& mine, const Comm& comm) {
  struct Entry {
    std::int32_t plane;
    std::uint64_t work;
  };
  std::vector<Entry> entries;
  entries.reserve(mine.size());
  for (const auto& [plane, work] : mine) entries.push_back({plane, work});
  PlaneWork all;
  std::uint64_t total = 0;
  for (const Entry& e : comm.allgather_arrays(std::span<const Entry>(entries))) {
    all[e.plane] += e.work;
    total += e.work;
  }

  Slabs slabs;
  slabs.axis_ = axis;
  const auto ranks = static_cast<std::uint64_t>(comm.size());
  for (std::uint64_t k = 1; k < ranks; ++k) {
    // The plane that leaves nearest to k/ranks of the work before it; many ranks may choose the same one.
    std::int32_t best = std::numeric_limits<std::int32_t>::max();
    std::uint64_t best_error = total - total * k / ranks;
    std::uint64_t before = 0;
    for (const auto& [plane, work] : all) {
      const std::uint64_t share = total * k / ranks;
      const std::uint64_t error = before > share ? before - share : share - before;
      if (error < best_error) {
        best = plane;
        best_error = error;
      }
      before += work;
    }
    slabs.cuts_.push_back(best);
  }
  return slabs;
}

int Slabs::owner(std::int32_t plane) const {
  return static_cast<int>(std::upper_bound(cuts_.begin(), cuts_.end(), plane) - cuts_.begin());
}

}  // namespace breccia::mpi

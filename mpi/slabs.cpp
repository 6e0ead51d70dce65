#include "mpi/slabs.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>

namespace breccia::mpi {
namespace {

// Planes in their order with the work before each: a slab is a range of indices, its work a difference.
struct Row {
  std::vector<std::int32_t> plane;
  std::vector<std::uint64_t> before{0};

  explicit Row(const PlaneWork& all) {
    for (const auto& [p, work] : all) {
      plane.push_back(p);
      before.push_back(before.back() + work);
    }
  }
  [[nodiscard]] std::size_t size() const { return plane.size(); }
  [[nodiscard]] std::uint64_t work(std::size_t first, std::size_t last) const { return before[last] - before[first]; }

  // The furthest end of a slab from `first` with at most `limit`.
  [[nodiscard]] std::size_t furthest(std::size_t first, std::uint64_t limit) const {
    const auto end =
        std::upper_bound(before.begin() + static_cast<std::ptrdiff_t>(first), before.end(), before[first] + limit);
    return static_cast<std::size_t>(end - before.begin()) - 1;
  }
  // The earliest begin of a slab up to `last` with at most `limit`.
  [[nodiscard]] std::size_t earliest(std::size_t last, std::uint64_t limit) const {
    const std::uint64_t least = before[last] > limit ? before[last] - limit : 0;
    return static_cast<std::size_t>(std::lower_bound(before.begin(), before.end(), least) - before.begin());
  }
  [[nodiscard]] bool fits(std::uint64_t limit, int ranks) const {
    std::size_t at = 0;
    for (int r = 0; r < ranks && at < size(); ++r) at = furthest(at, limit);
    return at == size();
  }
};

// The least that the busiest rank can have.
std::uint64_t least_maximum(const Row& row, int ranks) {
  const auto r = static_cast<std::uint64_t>(ranks);
  std::uint64_t low = (row.before.back() + r - 1) / r;
  std::uint64_t high = row.before.back();
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    if (row.fits(middle, ranks)) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

}  // namespace

PlaneWork sum_over_ranks(const PlaneWork& mine, const Comm& comm) {
  struct Entry {
    std::int32_t plane;
    std::uint64_t work;
  };
  std::vector<Entry> entries;
  entries.reserve(mine.size());
  for (const auto& [plane, work] : mine) entries.push_back({plane, work});
  PlaneWork all;
  for (const Entry& e : comm.allgather_arrays(std::span<const Entry>(entries))) all[e.plane] += e.work;
  return all;
}

std::uint64_t total(const PlaneWork& work) {
  std::uint64_t sum = 0;
  for (const auto& [plane, w] : work) sum += w;
  return sum;
}

std::int64_t extent(const PlaneWork& work) {
  const std::uint64_t tail = total(work) / 20;
  std::int32_t low = 0;
  std::uint64_t before = 0;
  for (const auto& [plane, w] : work) {
    if (before <= tail && w > 0) low = plane;
    before += w;
    if (before >= total(work) - tail) return std::int64_t{plane} - low + 1;
  }
  return 0;
}

Slabs Slabs::balanced(int axis, const PlaneWork& all, int ranks) {
  const Row row(all);
  const std::uint64_t limit = least_maximum(row, ranks);
  // The first plane that rank k may begin with, from behind: the slabs after it must hold the rest.
  std::vector<std::size_t> first(static_cast<std::size_t>(ranks), row.size());
  for (std::size_t k = first.size(); k-- > 1;) {
    first[k] = row.earliest(k + 1 < first.size() ? first[k + 1] : row.size(), limit);
  }
  Slabs slabs;
  slabs.axis_ = axis;
  std::size_t begin = 0;
  for (std::size_t k = 1; k < first.size(); ++k) {
    // As much as those that are left have on average, and a plane if there is one.
    const std::uint64_t share = row.work(begin, row.size()) / (first.size() - k + 1);
    const std::size_t last = row.furthest(begin, limit);
    std::size_t best = std::max(std::min(begin + 1, row.size()), first[k]);
    const auto error = [&](std::size_t i) {
      const std::uint64_t own = row.work(begin, i);
      return own > share ? own - share : share - own;
    };
    for (std::size_t i = best; i <= last; ++i) {
      if (error(i) < error(best)) best = i;
    }
    begin = best;
    slabs.cuts_.push_back(begin < row.size() ? row.plane[begin] : std::numeric_limits<std::int32_t>::max());
  }
  return slabs;
}

int Slabs::owner(std::int32_t plane) const {
  return static_cast<int>(std::upper_bound(cuts_.begin(), cuts_.end(), plane) - cuts_.begin());
}

std::vector<std::uint64_t> Slabs::shares(const PlaneWork& all) const {
  std::vector<std::uint64_t> shares(cuts_.size() + 1, 0);
  for (const auto& [plane, work] : all) shares[static_cast<std::size_t>(owner(plane))] += work;
  return shares;
}

}  // namespace breccia::mpi

#include "mpi/slabs.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

namespace breccia::mpi {
namespace {

// Past every plane, and where a block begins.
constexpr std::int32_t kNoPlane = std::numeric_limits<std::int32_t>::max() / 64 * 64;

// Planes of nodes in their order with the work before each: a slab is a range of indices. Its work grows with it at
// either end, by more than the plane's own where a block begins.
struct Row {
  std::vector<std::int32_t> plane;
  std::vector<std::uint64_t> before{0};      // work of nodes before a plane
  std::vector<std::uint64_t> blocks_before;  // work of blocks before that of a plane
  std::vector<std::uint64_t> blocks_up_to;   // with it

  explicit Row(const PlaneWork& all) {
    std::uint64_t blocks = 0;
    for (const auto& [p, work] : all.nodes) {
      const bool new_block = plane.empty() || block_of_plane(plane.back()) != block_of_plane(p);
      if (new_block) blocks = blocks_up_to.empty() ? 0 : blocks_up_to.back();
      const auto found = all.blocks.find(block_of_plane(p));
      plane.push_back(p);
      before.push_back(before.back() + work);
      blocks_before.push_back(blocks);
      blocks_up_to.push_back(blocks + (found == all.blocks.end() ? 0 : found->second));
    }
  }
  [[nodiscard]] std::size_t size() const { return plane.size(); }
  [[nodiscard]] std::uint64_t work(std::size_t first, std::size_t last) const {
    return first == last ? 0 : before[last] - before[first] + blocks_up_to[last - 1] - blocks_before[first];
  }

  // The furthest end of a slab from `first` with at most `limit`.
  [[nodiscard]] std::size_t furthest(std::size_t first, std::uint64_t limit) const {
    std::size_t fits = first;
    std::size_t end = size();
    while (fits < end) {
      const std::size_t middle = end - (end - fits) / 2;
      if (work(first, middle) <= limit) {
        fits = middle;
      } else {
        end = middle - 1;
      }
    }
    return fits;
  }
  // The earliest begin of a slab up to `last` with at most `limit`.
  [[nodiscard]] std::size_t earliest(std::size_t last, std::uint64_t limit) const {
    std::size_t fits = last;
    std::size_t begin = 0;
    while (begin < fits) {
      const std::size_t middle = begin + (fits - begin) / 2;
      if (work(middle, last) <= limit) {
        fits = middle;
      } else {
        begin = middle + 1;
      }
    }
    return fits;
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
  std::uint64_t high = row.work(0, row.size());
  std::uint64_t low = (high + r - 1) / r;
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
  const auto of_all_ranks = [&](const std::map<std::int32_t, std::uint64_t>& own) {
    std::vector<Entry> entries;
    entries.reserve(own.size());
    for (const auto& [plane, work] : own) entries.push_back({plane, work});
    return comm.allgather_arrays(std::span<const Entry>(entries));
  };
  PlaneWork all;
  for (const Entry& e : of_all_ranks(mine.nodes)) all.nodes[e.plane] += e.work;
  for (const Entry& e : of_all_ranks(mine.blocks)) all.blocks[e.plane] = std::max(all.blocks[e.plane], e.work);
  return all;
}

std::uint64_t total(const PlaneWork& work) {
  std::uint64_t sum = 0;
  for (const auto& [plane, w] : work.nodes) sum += w;
  for (const auto& [plane, w] : work.blocks) sum += w;
  return sum;
}

std::int64_t extent(const PlaneWork& work) {
  std::uint64_t all = 0;
  for (const auto& [plane, w] : work.nodes) all += w;
  const std::uint64_t tail = all / 20;
  std::int32_t low = 0;
  std::uint64_t before = 0;
  for (const auto& [plane, w] : work.nodes) {
    if (before <= tail && w > 0) low = plane;
    before += w;
    if (before >= all - tail) return std::int64_t{plane} - low + 1;
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
    slabs.cuts_.push_back(begin < row.size() ? row.plane[begin] : kNoPlane);
  }
  return slabs;
}

int Slabs::owner(std::int32_t plane) const {
  return static_cast<int>(std::upper_bound(cuts_.begin(), cuts_.end(), plane) - cuts_.begin());
}

bool Slabs::keep_whole(std::int32_t planes) const {
  return std::ranges::all_of(cuts_, [planes](std::int32_t plane) { return plane % planes == 0; });
}

std::vector<std::uint64_t> Slabs::shares(const PlaneWork& all) const {
  std::vector<std::uint64_t> shares(cuts_.size() + 1, 0);
  std::optional<std::pair<int, std::int32_t>> last;  // rank and block of the plane before
  for (const auto& [plane, work] : all.nodes) {
    const std::pair part{owner(plane), block_of_plane(plane)};
    std::uint64_t& share = shares[static_cast<std::size_t>(part.first)];
    share += work;
    const auto block = all.blocks.find(part.second);
    if (last != part && block != all.blocks.end()) share += block->second;
    last = part;
  }
  return shares;
}

}  // namespace breccia::mpi

// Tiles are sorted by x first, so a plane of blocks is a run of tiles. A plane writes to nodes of its own blocks and of
// the nearer half of the two planes beside it; planes two apart share no node. Every even plane runs before its odd
// neighbours: that fixes the order of all sums whatever the number of threads.
#include "grid/sweep_plan.hpp"

#include <cmath>

namespace breccia::grid {
namespace {

std::int32_t plane_of(const SweepTile& tile) { return block_coord(tile.stack).x; }

std::uint32_t index(std::size_t plane) { return static_cast<std::uint32_t>(plane); }

// The planes of all tiles; those of the boundary, or all others, join the order.
std::vector<SweepPlane> planes_of(std::span<const SweepTile> tiles, bool boundary, std::int32_t period,
                                  std::vector<std::uint32_t>& order) {
  std::vector<SweepPlane> planes;
  for (std::uint32_t t = 0; t < tiles.size(); ++t) {
    const auto end = static_cast<std::uint32_t>(order.size());
    const std::int32_t x = plane_of(tiles[t]);
    if (t == 0 || plane_of(tiles[t - 1]) != x) {
      planes.push_back({.first_tile = t, .first = end, .last = end, .turn = sweep_turn(x, period)});
    }
    planes.back().last_tile = t + 1;
    if (tiles[t].boundary != boundary) continue;
    order.push_back(t);
    planes.back().last = end + 1;
  }
  return planes;
}

void join_neighbours(std::vector<SweepPlane>& planes, std::span<const SweepTile> tiles, std::int32_t period) {
  const auto x = [&](std::size_t n) { return plane_of(tiles[planes[n].first_tile]); };
  const auto join = [&](std::size_t left, std::size_t right) {
    planes[left].right = index(right);
    planes[right].left = index(left);
  };
  for (std::size_t n = 1; n < planes.size(); ++n) {
    if (x(n) == x(n - 1) + 1) join(n - 1, n);
  }
  // Beyond the end of a period it begins again.
  if (period > 1 && planes.size() > 1 && x(0) == 0 && x(planes.size() - 1) == period - 1) join(planes.size() - 1, 0);
}

// Homes of about the same cost. They begin with planes that wait for none of another home, where there are such.
std::vector<std::uint32_t> homes_of(const std::vector<SweepPlane>& planes, std::span<const SweepTile> tiles,
                                    std::span<const std::uint32_t> order, int threads) {
  std::vector<double> before{0.0};  // cost of all planes before each
  for (const SweepPlane& plane : planes) {
    double cost = before.back();
    for (std::uint32_t n = plane.first; n < plane.last; ++n) cost += tiles[order[n]].cost;
    before.push_back(cost);
  }
  std::vector<std::uint32_t> homes{0};
  for (int t = 1; t < threads; ++t) {
    const double wanted = before.back() * t / threads;
    const auto miss = [&](std::size_t n) { return std::abs(before[n] - wanted); };
    std::size_t best = planes.size();
    for (std::size_t n = homes.back(); n < planes.size(); ++n) {
      const bool may_begin = planes[n].turn == 0 || planes[n].left == kNoPlane;
      if (may_begin && miss(n) < miss(best)) best = n;
    }
    homes.push_back(index(best));
  }
  homes.push_back(index(planes.size()));
  return homes;
}

}  // namespace

Sweep plan_sweep(std::span<const SweepTile> tiles, std::int32_t period, int threads) {
  Sweep sweep;
  sweep.order.reserve(tiles.size());
  const auto plan = [&](bool boundary) {
    SweepPart part{.planes = planes_of(tiles, boundary, period, sweep.order), .homes = {}};
    join_neighbours(part.planes, tiles, period);
    part.homes = homes_of(part.planes, tiles, sweep.order, threads);
    return part;
  };
  sweep.boundary = plan(true);
  sweep.interior = plan(false);
  return sweep;
}

}  // namespace breccia::grid

// Tiles are sorted by x first, so a plane of blocks is a run of tiles. A plane writes to nodes of its own blocks and of
// the nearer half of the two planes beside it; planes two apart share no node. Every even plane runs before its odd
// neighbours: that fixes the order of all sums whatever the number of threads. Within that rule a thread takes planes
// in the order 0, 2, 1, 4, 3, ..., so that nodes are still in the cache when they are needed again; once both
// neighbours of a plane are done nobody will read the old velocities of its blocks or add to them, and they are updated
// at once.
#include "grid/sweep_plan.hpp"

#include <utility>

namespace breccia::grid {
namespace {

// The tiles of one plane of blocks, and where those that a sweep passes over stand in its order.
struct Plane {
  std::uint32_t first, last;
  std::uint32_t first_in_order, last_in_order;
  std::int32_t x;
};

// The planes of all tiles; those with boundary[t] == part join the order.
std::vector<Plane> planes_of(std::span<const BlockKey> tiles, std::span<const char> boundary, bool part,
                             std::vector<std::uint32_t>& order) {
  std::vector<Plane> planes;
  for (std::uint32_t t = 0; t < tiles.size(); ++t) {
    const std::int32_t x = block_coord(tiles[t]).x;
    const auto end = static_cast<std::uint32_t>(order.size());
    if (planes.empty() || planes.back().x != x) planes.push_back({t, t, end, end, x});
    planes.back().last = t + 1;
    if ((boundary[t] != 0) != part) continue;
    order.push_back(t);
    planes.back().last_in_order = end + 1;
  }
  return planes;
}

// One phase for each turn, all of which comes after the turn before; nothing trails.
std::vector<SweepPhase> sweep_by_turns(const std::vector<Plane>& planes, std::int32_t period) {
  std::vector<SweepPhase> phases(3);
  for (const Plane& p : planes) {
    if (p.first_in_order == p.last_in_order) continue;
    const SweepStep pass{p.first_in_order, p.last_in_order, false};
    phases[static_cast<std::size_t>(sweep_turn(p.x, period))].push_back({.steps = {pass}});
  }
  std::erase_if(phases, [](const SweepPhase& phase) { return phase.empty(); });
  for (std::size_t n = 1; n < phases.size(); ++n) {
    for (SweepTask& task : phases[n]) task.after_last = phases[n - 1].size();
  }
  return phases;
}

// Chunks of planes that begin with an even one. The odd plane at the end of a chunk comes after the even one behind it,
// which is the first of the next chunk: second phase, the tasks of which fill the time until all chunks are done.
class ChunkedSweep {
 public:
  ChunkedSweep(const std::vector<Plane>& planes, std::uint32_t tiles_per_chunk) : planes_(planes) {
    for (std::size_t first = 0; first < planes.size();) {
      std::size_t last = first + 1;
      while (last < planes.size() &&
             (odd(last) || planes[last].first_in_order - planes[first].first_in_order < tiles_per_chunk)) {
        ++last;
      }
      add_chunk(first, last);
      first = last;
    }
  }
  [[nodiscard]] std::vector<SweepPhase> phases() && { return {std::move(chunks_), std::move(late_)}; }

 private:
  [[nodiscard]] bool odd(std::size_t n) const { return (planes_[n].x & 1) != 0; }
  [[nodiscard]] bool next_to_each_other(std::size_t left) const {
    return left + 1 < planes_.size() && planes_[left + 1].x == planes_[left].x + 1;
  }

  void add_chunk(std::size_t first, std::size_t last) {
    SweepTask task;
    for (std::size_t n = first; n < last; ++n) {
      if (odd(n) && next_to_each_other(n)) continue;  // its turn comes after the even plane behind it
      task.steps.push_back(pass(n));
      const bool odd_before = n > first && odd(n - 1) && next_to_each_other(n - 1);
      if (odd(n)) update_around(task, n, first);
      if (!odd(n) && odd_before) {
        task.steps.push_back(pass(n - 1));
        update_around(task, n - 1, first);
      }
    }
    if (odd(last - 1) && next_to_each_other(last - 1)) {
      late_.push_back({.steps = {pass(last - 1)}, .after_first = chunks_.size(), .after_last = chunks_.size() + 2});
    }
    chunks_.push_back(std::move(task));
  }

  // The odd plane n is done, and so are its neighbours. The plane before it is complete too if what lies before that
  // belongs to this chunk or does not exist.
  void update_around(SweepTask& task, std::size_t n, std::size_t first) const {
    const bool has_before = n > first && next_to_each_other(n - 1);
    const bool complete = has_before && (n - 1 > first || n - 1 == 0 || !next_to_each_other(n - 2));
    if (complete) task.steps.push_back(update(n - 1));
    task.steps.push_back(update(n));
  }

  [[nodiscard]] SweepStep pass(std::size_t n) const {
    return {planes_[n].first_in_order, planes_[n].last_in_order, false};
  }
  [[nodiscard]] SweepStep update(std::size_t n) const { return {planes_[n].first, planes_[n].last, true}; }

  const std::vector<Plane>& planes_;
  SweepPhase chunks_;
  SweepPhase late_;
};

}  // namespace

Sweep plan_sweep(std::span<const BlockKey> tiles, std::span<const char> boundary, std::int32_t period, int threads) {
  Sweep sweep;
  sweep.order.reserve(tiles.size());
  sweep.boundary = sweep_by_turns(planes_of(tiles, boundary, true, sweep.order), period);
  const auto boundary_tiles = static_cast<std::uint32_t>(sweep.order.size());
  const std::vector<Plane> planes = planes_of(tiles, boundary, false, sweep.order);
  if (period != 0) {
    sweep.interior = sweep_by_turns(planes, period);
    return sweep;
  }
  // Several chunks for each thread even out what a tile costs.
  const std::uint32_t chunks = threads == 1 ? 1U : 6U * static_cast<std::uint32_t>(threads);
  const auto interior_tiles = static_cast<std::uint32_t>(tiles.size()) - boundary_tiles;
  sweep.interior = ChunkedSweep(planes, interior_tiles / chunks + 1).phases();
  return sweep;
}

}  // namespace breccia::grid

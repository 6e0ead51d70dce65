// The sweep over the tiles: in which order, by which thread, and the grid update that trails behind it.
//
// Tiles are sorted by x first, so a plane of blocks is a run of tiles. A plane writes to nodes of its own blocks and of
// the nearer half of the two planes beside it; planes two apart share no node. Every even plane runs before its odd
// neighbours: that fixes the order of all sums whatever the number of threads. Within that rule a thread takes planes
// in the order 0, 2, 1, 4, 3, ..., so that nodes are still in the cache when they are needed again; once both
// neighbours of a plane are done nobody will read the old velocities of its blocks or add to them, and they are updated
// at once.
#include <algorithm>

#include "grid/host_engine.hpp"

namespace breccia::grid {
namespace {

// The tiles of one plane of blocks.
struct Plane {
  std::uint32_t first, last;
  std::int32_t x;
};

std::vector<Plane> planes_of(const BlockTable& blocks, std::uint32_t tiles) {
  std::vector<Plane> planes;
  for (std::uint32_t t = 0; t < tiles; ++t) {
    const std::int32_t x = block_coord(blocks.keys()[t]).x;
    if (planes.empty() || planes.back().x != x) planes.push_back({t, t, x});
    planes.back().last = t + 1;
  }
  return planes;
}

// On a periodic axis the last plane is next to the first: even planes, odd planes, and a phase of its own for the last
// one if their number is odd. Nothing trails.
std::vector<SweepPhase> periodic_sweep(const std::vector<Plane>& planes, std::int32_t period) {
  std::vector<SweepPhase> phases(3);
  for (const Plane& p : planes) {
    const bool odd_one_out = period % 2 == 1 && p.x == period - 1;
    phases[odd_one_out ? 2U : static_cast<std::uint32_t>(p.x & 1)].push_back({{p.first, p.last, false}});
  }
  return phases;
}

// Chunks of planes that begin with an even one. The odd plane at the end of a chunk waits for the even one behind it,
// which is the first of the next chunk: second phase.
class ChunkedSweep {
 public:
  ChunkedSweep(const std::vector<Plane>& planes, std::uint32_t tiles_per_chunk) : planes_(planes) {
    for (std::size_t first = 0; first < planes.size();) {
      std::size_t last = first + 1;
      while (last < planes.size() && (odd(last) || planes[last].first - planes[first].first < tiles_per_chunk)) {
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
      pass(task, n);
      const bool odd_before = n > first && odd(n - 1) && next_to_each_other(n - 1);
      if (odd(n)) update_around(task, n, first);
      if (!odd(n) && odd_before) {
        pass(task, n - 1);
        update_around(task, n - 1, first);
      }
    }
    if (odd(last - 1) && next_to_each_other(last - 1)) late_.push_back({step(last - 1, false)});
    chunks_.push_back(std::move(task));
  }

  // The odd plane n is done, and so are its neighbours. The plane before it is complete too if what lies before that
  // belongs to this chunk or does not exist.
  void update_around(SweepTask& task, std::size_t n, std::size_t first) const {
    const bool has_before = n > first && next_to_each_other(n - 1);
    const bool complete = has_before && (n - 1 > first || n - 1 == 0 || !next_to_each_other(n - 2));
    if (complete) task.push_back(step(n - 1, true));
    task.push_back(step(n, true));
  }

  void pass(SweepTask& task, std::size_t n) const { task.push_back(step(n, false)); }
  [[nodiscard]] SweepStep step(std::size_t n, bool update) const { return {planes_[n].first, planes_[n].last, update}; }

  const std::vector<Plane>& planes_;
  SweepPhase chunks_;
  SweepPhase late_;
};

}  // namespace

template <class P>
void HostEngine<P>::plan_sweep() {
  const auto tiles = static_cast<std::uint32_t>(tiles_.size());
  const std::vector<Plane> planes = planes_of(blocks_, tiles);
  if (periodicity_.blocks[0] != 0) {
    sweep_ = periodic_sweep(planes, periodicity_.blocks[0]);
    return;
  }
  // Several chunks for each thread even out what a tile costs.
  const std::uint32_t chunks = setup_.threads == 1 ? 1U : 4U * static_cast<std::uint32_t>(setup_.threads);
  sweep_ = ChunkedSweep(planes, tiles / chunks + 1).phases();
}

template <class P>
void HostEngine<P>::run_task(const SweepTask& task, const PassArguments<P>& arguments, const NodeArguments<P>* trailing,
                             std::vector<TileReport>& reports) const {
  for (const SweepStep& step : task) {
    if (!step.update) {
      for (std::uint32_t t = step.first; t < step.last; ++t) kernels_.pass(arguments, t, reports[t]);
    } else if (trailing != nullptr) {
      // Block t is that of tile t. What other ranks add to waits for them.
      for (std::uint32_t b = step.first; b < step.last; ++b) {
        if (is_shared_[b] == 0) kernels_.update_blocks(*trailing, b, b + 1);
      }
    }
  }
}

template <class P>
void HostEngine<P>::run_pass(const PassArguments<P>& arguments, const NodeArguments<P>* trailing) {
  constexpr std::uint32_t kChunk = 16;
  const auto lone_packs = static_cast<std::uint32_t>(lone_pull_.size());
  fault_ = {};
  std::vector<TileReport> reports(tiles_.size());
  std::vector<TileReport> lone_reports((lone_packs + kChunk - 1) / kChunk);
#pragma omp parallel num_threads(setup_.threads)
  {
#pragma omp for schedule(static) nowait
    for (std::size_t n = 0; n < lone_reports.size(); ++n) {
      const auto first = static_cast<std::uint32_t>(n) * kChunk;
      kernels_.lone_pass(arguments, first, std::min(first + kChunk, lone_packs), lone_reports[n]);
    }
    for (const SweepPhase& phase : sweep_) {
#pragma omp for schedule(dynamic, 1)
      for (const SweepTask& task : phase) run_task(task, arguments, trailing, reports);
    }
  }
  report_.largest_move = 0.0;
  if (fault_.slot != PassFault::kNone && !report_.fault) {
    report_fault();
    report_.fault_step = gathers_;
  }
  gathers_ += arguments.gather ? 1 : 0;
  const auto book = [&](const TileReport& r) {
    report_.plastic_work += r.plastic_work;
    report_.viscous_work += r.viscous_work;
    report_.largest_move = std::max(report_.largest_move, r.largest_move);
    report_.clamped += r.clamped;
    strayed_packs_ += r.strayed;
  };
  std::for_each(reports.begin(), reports.end(), book);
  std::for_each(lone_reports.begin(), lone_reports.end(), book);
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

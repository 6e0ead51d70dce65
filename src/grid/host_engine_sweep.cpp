// The pass over all particles of this rank: boundary tiles first, so that their sums travel to other ranks while the
// interior is computed (docs/overlap.md).
#include <algorithm>

#include "grid/host_engine.hpp"
#include "grid/sweep_board.hpp"

namespace breccia::grid {

template <class P>
void HostEngine<P>::run_task(const SweepTask& task, const PassArguments<P>& arguments, const NodeArguments<P>* trailing,
                             std::vector<TileReport>& reports) {
  // Tiles between two looks at the messages: some ten microseconds.
  constexpr std::uint32_t kStretch = 8;
  for (const SweepStep& step : task.steps) {
    for (std::uint32_t n = step.first; n < step.last; ++n) {
      if (!step.update) {
        const std::uint32_t tile = sweep_.order[n];
        kernels_.pass(arguments, tile, reports[tile]);
        if (n % kStretch == 0) progress(trailing);
      } else if (trailing != nullptr) {
        update_stack(tiles_[n], *trailing);
      }
    }
  }
}

template <class P>
void HostEngine<P>::update_stack(const Tile& tile, const NodeArguments<P>& arguments) {
  for (std::uint32_t b = tile.first_block; b < tile.last_block; ++b) {
    // What other ranks add to waits for them.
    if (block_sums_[b] == BlockSums::kInPlace) kernels_.update_blocks(arguments, b, b + 1);
  }
}

template <class P>
void HostEngine<P>::run_pass(const PassArguments<P>& arguments, const NodeArguments<P>* trailing) {
  constexpr std::uint32_t kChunk = 16;
  const auto lone_packs = static_cast<std::uint32_t>(lone_pull_.size());
  fault_ = {};
  std::vector<TileReport> reports(tiles_.size());
  std::vector<TileReport> lone_reports((lone_packs + kChunk - 1) / kChunk);
  const auto begin = Timeline::Clock::now();
  auto boundary_done = begin;
  const bool early = arguments.scatter && setup_.numerics.overlap;
  SweepBoard board(sweep_.interior);
#pragma omp parallel num_threads(setup_.threads)
  {
    for (const SweepPhase& phase : sweep_.boundary) {
#pragma omp for schedule(dynamic, 1)
      for (const SweepTask& task : phase) run_task(task, arguments, trailing, reports);
    }
#pragma omp master
    {
      boundary_done = Timeline::Clock::now();
      if (early) send_sums();
    }
#pragma omp for schedule(dynamic, 1) nowait
    for (std::size_t n = 0; n < lone_reports.size(); ++n) {
      const auto first = static_cast<std::uint32_t>(n) * kChunk;
      kernels_.lone_pass(arguments, first, std::min(first + kChunk, lone_packs), lone_reports[n]);
    }
    // A thread leaves a phase only when all its tasks have been taken: what it waits for later is being done by others,
    // who wait for nothing behind it.
    for (std::size_t p = 0; p < sweep_.interior.size(); ++p) {
      const SweepPhase& phase = sweep_.interior[p];
#pragma omp for schedule(dynamic, 1) nowait
      for (std::size_t n = 0; n < phase.size(); ++n) {
        board.wait_for_turn(p, phase[n]);
        run_task(phase[n], arguments, trailing, reports);
        board.finish(p, n);
      }
    }
  }
  note("boundary tiles", Timeline::Lane::kTiles, begin, boundary_done);
  note("interior tiles", Timeline::Lane::kTiles, boundary_done, Timeline::Clock::now());
  if (arguments.scatter && !early) send_sums();
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

// The pass over all particles of this rank: boundary tiles first, so that their sums travel to other ranks while the
// interior is computed (docs/overlap.md).
#include <omp.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "grid/host_engine.hpp"
#include "grid/sweep_board.hpp"

namespace breccia::grid {
namespace {

// Particles without grid, of which threads take some at a time. They wait for nobody.
template <class P>
class LoneChunks {
 public:
  LoneChunks(const Kernels<P>& kernels, const PassArguments<P>& arguments, std::uint32_t packs)
      : kernels_(kernels), arguments_(arguments), packs_(packs), reports_((packs + kPacks - 1) / kPacks) {}

  /// False: none are left.
  bool run_one() {
    const std::size_t n = next_++;
    if (n >= reports_.size()) return false;
    const auto first = static_cast<std::uint32_t>(n) * kPacks;
    kernels_.lone_pass(arguments_, first, std::min(first + kPacks, packs_), reports_[n]);
    return true;
  }
  /// After so many tiles. Lone particles stream through memory, which two threads at once do slower than one: so they
  /// are dealt in between tiles, which do not.
  void run_some(std::uint32_t tiles) {
    constexpr std::uint32_t kTiles = 8;
    for (std::uint32_t n = kTiles / 2; n < tiles; n += kTiles) run_one();
  }
  [[nodiscard]] std::span<const TileReport> reports() const { return reports_; }

 private:
  static constexpr std::uint32_t kPacks = 16;

  const Kernels<P>& kernels_;
  const PassArguments<P>& arguments_;
  std::uint32_t packs_;
  std::vector<TileReport> reports_;
  std::atomic<std::size_t> next_{0};
};

}  // namespace

template <class P>
void HostEngine<P>::run_work(SweepWork work, const SweepPlane& plane, const PassArguments<P>& arguments,
                             const NodeArguments<P>* trailing, std::vector<TileReport>& reports) {
  // Tiles between two looks at the messages: some ten microseconds.
  constexpr std::uint32_t kStretch = 8;
  if (work.kind == SweepWork::Kind::kUpdate) {
    for (std::uint32_t t = plane.first_tile; t < plane.last_tile; ++t) update_stack(tiles_[t], *trailing);
    return;
  }
  const bool asks_ahead = outgrows_cache();
  for (std::uint32_t n = plane.first; n < plane.last; ++n) {
    const std::uint32_t tile = sweep_.order[n];
    const bool asks = asks_ahead && n + 1 < plane.last;
    kernels_.pass(arguments, tile, asks ? sweep_.order[n + 1] : kNoTile, reports[tile]);
    if (n % kStretch == 0) progress(trailing);
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
  fault_ = {};
  std::vector<TileReport> reports(tiles_.size());
  LoneChunks<P> lone(kernels_, arguments, static_cast<std::uint32_t>(lone_pull_.size()));
  const auto run_part = [&](const SweepPart& part, SweepBoard& board) {
    for (;;) {
      if (const auto work = board.take(omp_get_thread_num())) {
        const SweepPlane& plane = part.planes[work->plane];
        run_work(*work, plane, arguments, trailing, reports);
        board.finish(*work);
        // Messages wait for the boundary.
        const bool interior = &part == &sweep_.interior;
        if (interior && work->kind == SweepWork::Kind::kPass) lone.run_some(plane.last - plane.first);
      } else if (board.all_taken()) {
        return;
      } else if (!lone.run_one()) {
        progress(trailing);
        std::this_thread::yield();
      }
    }
  };
  const auto begin = Timeline::Clock::now();
  auto boundary_done = begin;
  const bool early = arguments.scatter && setup_.numerics.overlap;
  SweepBoard boundary(sweep_.boundary, false);
  SweepBoard interior(sweep_.interior, trailing != nullptr);
#pragma omp parallel num_threads(setup_.threads)
  {
    run_part(sweep_.boundary, boundary);
#pragma omp barrier
#pragma omp master
    {
      boundary_done = Timeline::Clock::now();
      if (early) send_sums();
    }
    run_part(sweep_.interior, interior);
    while (lone.run_one()) progress(trailing);
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
  book(reports);
  book(lone.reports());
}

template <class P>
void HostEngine<P>::book(std::span<const TileReport> reports) {
  for (const TileReport& r : reports) {
    report_.plastic_work += r.plastic_work;
    report_.viscous_work += r.viscous_work;
    report_.largest_move = std::max(report_.largest_move, r.largest_move);
    report_.clamped += r.clamped;
    strayed_packs_ += r.strayed;
  }
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

#include "sim/balance.hpp"

#include <algorithm>

namespace breccia::sim {
namespace {

// Time of one evaluation on a core of a Xeon with AVX-512, mixed precision, by what its Solver::work() counts [ps]
// (breccia_bench work, phases of --profile). The transforms of the mesh are not in it: ranks share them by planes of
// the mesh, wherever the particles are.
struct GravityWeights {
  double unit;      ///< of the work, a pair of particles
  double particle;  ///< besides, for each particle: sorting, moments, assignment
};
constexpr GravityWeights kDirect{.unit = 276, .particle = 0};
constexpr GravityWeights kTree{.unit = 360, .particle = 90e3};
constexpr GravityWeights kTreePm{.unit = 430, .particle = 120e3};

const GravityWeights& weights_of(GravityMethod method) {
  return method == GravityMethod::kDirect ? kDirect : method == GravityMethod::kTree ? kTree : kTreePm;
}

// Moving particles and sorting them again costs a few steps: what is won must be worth it.
constexpr double kLeastGain = 0.02;  // of the mean work

double largest(const std::vector<std::uint64_t>& shares) {
  return static_cast<double>(*std::ranges::max_element(shares));
}

double mean(const std::vector<std::uint64_t>& shares) {
  std::uint64_t sum = 0;
  for (const std::uint64_t s : shares) sum += s;
  return static_cast<double>(sum) / static_cast<double>(shares.size());
}

double imbalance_of(const std::vector<std::uint64_t>& shares) {
  return mean(shares) > 0.0 ? largest(shares) / mean(shares) : 1.0;
}

}  // namespace

std::vector<double> gravity_work(const gravity::Solver& solver, int interval) {
  const GravityWeights& w = weights_of(solver.last().method);
  std::vector<double> work(solver.work().begin(), solver.work().end());
  for (double& pairs : work) pairs = (w.unit * pairs + w.particle) / interval;
  return work;
}

void Balance::at_window_start(grid::Engine& engine, const gravity::Solver* solver) {
  if (comm_.size() == 1) return;
  const mpi::PlaneWork mine = engine.work(solver != nullptr ? gravity_work(*solver, interval_) : std::vector<double>{});
  const std::vector<std::uint64_t> now = comm_.allgather(mpi::total(mine));
  double imbalance = imbalance_of(now);
  const bool uneven = parallel_.balance == BalanceMode::kAuto && imbalance > parallel_.imbalance;
  if (uneven || parallel_.balance == BalanceMode::kAlways) {
    const mpi::PlaneWork all = mpi::sum_over_ranks(mine, comm_);
    const mpi::Slabs slabs = mpi::Slabs::balanced(engine.slabs().axis(), all, comm_.size());
    const std::vector<std::uint64_t> then = slabs.shares(all);
    // What counts is the busiest rank: a cut through blocks adds to the mean.
    const bool better = largest(then) < largest(now) - kLeastGain * mean(now);
    const bool moved = slabs.cuts() != engine.slabs().cuts();
    if (parallel_.balance == BalanceMode::kAlways || (better && moved)) {
      engine.cut(slabs);
      ++state_.recuts;
      imbalance = imbalance_of(then);
    }
  }
  ++state_.windows;
  state_.imbalance = imbalance;
  state_.imbalance_sum += imbalance;
  state_.imbalance_max = std::max(state_.imbalance_max, imbalance);
}

}  // namespace breccia::sim

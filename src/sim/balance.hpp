// When slabs are cut anew: work is counted at the start of each gravity window, never timed, so that a run repeats.
#pragma once

#include <cstdint>
#include <vector>

#include "breccia/scene.hpp"
#include "gravity/solver.hpp"
#include "grid/engine.hpp"
#include "mpi/comm.hpp"
#include "sim/run_state.hpp"

namespace breccia::sim {

/// What gravity costs of each of this rank's particles in a step [ps], by the counts of the last evaluation, one for
/// each `interval` steps; in the order of Engine::predict().
std::vector<double> gravity_work(const gravity::Solver& solver, int interval);

/// Keeps the work of the ranks even, and a record of how even it was.
class Balance {
 public:
  Balance(const Scene& scene, const mpi::Comm& comm)
      : parallel_(scene.parallel), interval_(scene.gravity.interval), comm_(comm) {}

  /// Counts, and cuts the slabs of `engine` anew where the scene wants that. Between sort() and scatter(), just after
  /// `solver` evaluated gravity of these particles in this order; null if it did not. Collective.
  void at_window_start(grid::Engine& engine, const gravity::Solver* solver);

  [[nodiscard]] const BalanceState& state() const { return state_; }
  void restore(const BalanceState& state) { state_ = state; }

 private:
  ParallelParameters parallel_;
  int interval_;
  mpi::Comm comm_;
  BalanceState state_;
};

}  // namespace breccia::sim

// The conservation budget at one time.
#pragma once

#include "gravity/solver.hpp"
#include "grid/engine.hpp"
#include "io/diagnostics.hpp"
#include "io/summary.hpp"
#include "mpi/comm.hpp"
#include "sim/run_state.hpp"

namespace breccia::sim {

/// Sums a row over all ranks and follows the drifts from the first row.
class Budget {
 public:
  /// What a row may have gained in energy, over the largest kinetic + |potential| so far. Resolved bodies only lose
  /// energy but for rounding and the order of the step, 1e-6 in the flagship collision; the transfers of a body of few
  /// cells that flies apart can make a quarter (tests/stability, SpinBeyondBreakUp). Twice as much is neither; an
  /// unstable run gains as much as it has within a few windows.
  static constexpr double kEnergyGain = 0.5;

  /// `solver` may be null (no self-gravity). `uniform_gravity` [m/s2].
  Budget(gravity::Solver* solver, Vec3d uniform_gravity, const mpi::Comm& comm, double energy_gain = kEnergyGain)
      : solver_(solver), uniform_gravity_(uniform_gravity), comm_(comm), energy_gain_(energy_gain) {}

  /// The row at t_n, after Engine::update_grid(). Collective. Throws NumericsError if a sum is not finite, a particle
  /// or mass is missing or energy was gained; time, step, dt and wall_seconds are left to the caller.
  io::DiagnosticsRow row(const grid::Engine& engine, const ParticleOutput& particles, const LostWork& lost);

  /// Self-gravity at each particle [J/kg]; empty without a solver. Collective.
  [[nodiscard]] std::vector<double> potential(const ParticleOutput& particles) const;

  /// Largest drifts seen so far.
  [[nodiscard]] const io::Conservation& drift() const { return state_.drift; }

  [[nodiscard]] const BudgetState& state() const { return state_; }
  void restore(const BudgetState& state) { state_ = state; }

 private:
  void require_sums(const io::DiagnosticsRow& row) const;
  void require_no_gain(const io::DiagnosticsRow& row) const;
  void follow(const io::DiagnosticsRow& row, double momentum_scale, double angular_scale);

  gravity::Solver* solver_;
  Vec3d uniform_gravity_;
  mpi::Comm comm_;
  double energy_gain_;
  BudgetState state_;
};

}  // namespace breccia::sim

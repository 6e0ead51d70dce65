// The conservation budget at one time.
#pragma once

#include "breccia/scene.hpp"
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
  /// `solver` may be null (no self-gravity).
  Budget(gravity::Solver* solver, const Scene& scene, const mpi::Comm& comm);

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
  void require_sums(const io::DiagnosticsRow& row, const ParticleOutput& particles) const;
  void require_no_gain(const io::DiagnosticsRow& row) const;
  void follow(const io::DiagnosticsRow& row, double momentum_scale, double angular_scale);

  gravity::Solver* solver_;
  Vec3d uniform_gravity_;
  double affine_moment_;  // what C carries, for each kg and 1/s [m2]
  mpi::Comm comm_;
  double energy_gain_;
  BudgetState state_;
};

}  // namespace breccia::sim

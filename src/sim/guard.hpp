// What must hold of a run's numbers at every sorting and every window. Faults are seen by the pass that makes them
// (grid/pack_fault.hpp) and kept here until all ranks meet: none may wait for one that has stopped.
#pragma once

#include <cstdint>
#include <optional>

#include "breccia/scene.hpp"
#include "grid/engine.hpp"
#include "mpi/comm.hpp"

namespace breccia::sim {

/// The first particle that went wrong.
struct GuardedFault {
  std::uint64_t step = 0;  ///< in which it happened
  double time = 0.0;       ///< at the start of that step [s]
  int rank = 0;
  grid::ParticleFault particle;
};

class Guard {
 public:
  /// A step this much smaller than that of the scene at rest is a collapse: sound is at most a few times faster in
  /// shocked rock, and no impact this code is for reaches a hundred times the sound speed.
  static constexpr double kCollapse = 1e-3;

  /// `step_at_rest`: the stable time step of the scene at rest [s].
  Guard(const Scene& scene, double step_at_rest, const mpi::Comm& comm);

  /// Takes up what a pass of the step that began at `time` found; not collective.
  void note(const grid::PassReport& report, std::uint64_t step, double time);

  /// Throws NumericsError, the same on all ranks, if a particle of any rank went wrong since the start, left the grid
  /// around it, or is missing. Collective.
  void check(const grid::Engine& engine);
  /// Throws NumericsError if the time step has collapsed. `dt` is that of all ranks. Collective.
  void check_step(double dt, const grid::Engine& engine);

  /// After check() has thrown: the particle, if it is known which. The same on all ranks.
  [[nodiscard]] const std::optional<GuardedFault>& fault() const { return fault_; }
  /// The fastest particle of all ranks, or one that has left the grid around it. Collective.
  [[nodiscard]] grid::ParticleSample fastest(const grid::Engine& engine) const;

 private:
  void share_fault();

  std::uint64_t particles_ = 0;
  double step_at_rest_;
  mpi::Comm comm_;
  std::optional<GuardedFault> fault_;
};

}  // namespace breccia::sim

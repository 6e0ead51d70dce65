// Self-gravity where an engine keeps its particles, for devices: neither positions nor accelerations pass through the
// host unless ranks exchange them.
#pragma once

#include <memory>

#include "gravity/solver.hpp"

namespace breccia::gravity {

class ResidentSolver {
 public:
  ResidentSolver() = default;
  ResidentSolver(const ResidentSolver&) = delete;
  ResidentSolver& operator=(const ResidentSolver&) = delete;
  virtual ~ResidentSolver() = default;

  /// Evaluates the field where the particles will be after `time` [s] at their present velocities, and sets the
  /// acceleration that they hold. Collective.
  virtual void evaluate_and_hold(double time) = 0;

  /// Of the last evaluation.
  [[nodiscard]] virtual const Stats& last() const = 0;
};

/// An engine that can do so.
class ResidentParticles {
 public:
  virtual ~ResidentParticles() = default;

  /// Null where the engine has not that method: the particles then go to a Solver and their accelerations come back.
  /// The engine must outlive the solver.
  [[nodiscard]] virtual std::unique_ptr<ResidentSolver> make_resident_solver(GravityMethod method,
                                                                             const Parameters& parameters) = 0;
};

}  // namespace breccia::gravity

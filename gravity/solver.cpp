#include "gravity/solver.hpp"

#include <cmath>
#include <string>

#include "breccia/error.hpp"
#include "gravity/auto_solver.hpp"
#include "gravity/direct_sum.hpp"
#include "gravity/mesh/tree_pm.hpp"
#include "gravity/tree/tree_solver.hpp"

namespace breccia::gravity {

std::unique_ptr<Solver> make_solver(GravityMethod method, const Parameters& parameters, const mpi::Comm& comm,
                                    int threads) {
  if (!(parameters.softening >= 0.0) || !std::isfinite(parameters.softening)) {
    throw UsageError("gravity.softening = " + std::to_string(parameters.softening) +
                     " m: must be zero or a positive finite length");
  }
  if (!(parameters.error > 0.0) || !(parameters.opening >= 0.0)) {
    throw UsageError("gravity.error and gravity.opening must be positive");
  }
  switch (method) {
    case GravityMethod::kAuto:
      if (parameters.precision == Precision::kDouble) {
        return std::make_unique<AutoSolver<double>>(parameters, comm, threads);
      }
      return std::make_unique<AutoSolver<float>>(parameters, comm, threads);
    case GravityMethod::kDirect:
      return std::make_unique<DirectSum>(parameters, comm, threads);
    case GravityMethod::kOff:
      throw UsageError("effects.gravity = off: there is nothing to evaluate; use tree or direct");
    case GravityMethod::kTree:
      return std::make_unique<TreeSolver>(parameters, comm, threads);
    case GravityMethod::kTreePm:
      if (parameters.precision == Precision::kDouble) {
        return std::make_unique<TreePm<double>>(parameters, comm, threads);
      }
      return std::make_unique<TreePm<float>>(parameters, comm, threads);
  }
  throw UsageError("effects.gravity: unknown method; use auto");
}

}  // namespace breccia::gravity

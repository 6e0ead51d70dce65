#include "gravity/auto_solver.hpp"

namespace breccia::gravity {

void AutoSolver::evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) {
  const std::uint64_t all = comm_.sum(static_cast<std::uint64_t>(particles.position.size()));
  const bool direct = cheapest_method(all, parameters_.error) == GravityMethod::kDirect;
  used_ = direct ? static_cast<Solver*>(&direct_) : &tree_;
  used_->evaluate(particles, acceleration, potential);
}

}  // namespace breccia::gravity

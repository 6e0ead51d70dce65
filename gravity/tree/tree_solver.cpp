#include "gravity/tree/tree_solver.hpp"

#include <algorithm>

#include "gravity/evaluation.hpp"

namespace breccia::gravity {

TreeSolver::TreeSolver(const Parameters& parameters, const mpi::Comm& comm, int threads)
    : comm_(comm), field_(parameters, comm, std::max(threads, 1)) {}

void TreeSolver::evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) {
  check_sizes(particles, acceleration, potential);
  stats_ = {.method = GravityMethod::kTree};
  const Stopwatch whole(stats_.seconds);
  std::fill(acceleration.begin(), acceleration.end(), Vec3d{});
  std::fill(potential.begin(), potential.end(), 0.0);
  work_.assign(acceleration.size(), 0.0);
  field_.add_to(particles, {}, 1, heaviest(particles.mass, comm_), {acceleration, potential, work_}, stats_);
  remove_net_force(particles, acceleration, comm_, stats_);
}

}  // namespace breccia::gravity

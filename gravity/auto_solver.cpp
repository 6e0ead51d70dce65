#include "gravity/auto_solver.hpp"

#include "gravity/evaluation.hpp"

namespace breccia::gravity {

template <class Real>
void AutoSolver<Real>::evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) {
  check_sizes(particles, acceleration, potential);
  Phases choosing;
  Layout layout;
  Matter matter{.particles = comm_.sum(static_cast<std::uint64_t>(particles.position.size()))};
  if (!prefers_direct_sum(matter.particles, parameters_.error)) {
    choosing.time(Phase::kBoxes, [&] {
      layout = lay_boxes(particles, parameters_.mesh, comm_, threads_);
      matter = matter_of(layout);
    });
    parameters_.mesh.particle_spacing = layout.spacing;
  }
  const MethodChoice choice = cheapest_method(matter, parameters_);
  if (choice.method == GravityMethod::kTreePm) {
    mesh_.evaluate_in(layout, particles, acceleration, potential);
    used_ = &mesh_;
  } else {
    Solver& solver = choice.method == GravityMethod::kTree ? static_cast<Solver&>(tree_) : direct_;
    solver.evaluate(particles, acceleration, potential);
    used_ = &solver;
  }
  stats_ = used_->last();
  stats_.reason = choice.reason;
  stats_.seconds += choosing[Phase::kBoxes];
  stats_.phases[Phase::kBoxes] = choosing[Phase::kBoxes];
}

template class AutoSolver<float>;
template class AutoSolver<double>;

}  // namespace breccia::gravity

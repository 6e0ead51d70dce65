#include "gravity/mesh/tree_pm.hpp"

#include <algorithm>

#include "gravity/evaluation.hpp"
#include "gravity/mesh/settings.hpp"

namespace breccia::gravity {

template <class Real>
TreePm<Real>::TreePm(const Parameters& parameters, const mpi::Comm& comm, int threads)
    : parameters_(with_checked_mesh(parameters)),
      comm_(comm),
      threads_(std::max(threads, 1)),
      unsplit_(parameters, comm, threads_) {
  for (std::size_t k = 0; k < kMostBoxes; ++k) fields_.emplace_back(comm, threads_);
}

template <class Real>
void TreePm<Real>::evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) {
  check_sizes(particles, acceleration, potential);
  Phases laying;
  Layout layout;
  laying.time(Phase::kBoxes, [&] { layout = lay_boxes(particles, parameters_.mesh, comm_, threads_); });
  parameters_.mesh.particle_spacing = layout.spacing;
  evaluate_in(layout, particles, acceleration, potential);
  stats_.phases[Phase::kBoxes] = laying[Phase::kBoxes];
  stats_.seconds += laying[Phase::kBoxes];
}

template <class Real>
void TreePm<Real>::evaluate_in(const Layout& layout, ParticlesView particles, std::span<Vec3d> acceleration,
                               std::span<double> potential) {
  stats_ = {.method = GravityMethod::kTreePm};
  const Stopwatch watch(stats_.seconds);
  const double mass_unit = heaviest(particles.mass, comm_);
  stats_.boxes = static_cast<int>(layout.boxes.size());

  std::fill(acceleration.begin(), acceleration.end(), Vec3d{});
  std::fill(potential.begin(), potential.end(), 0.0);
  work_.assign(acceleration.size(), 0.0);
  const FieldView field{acceleration, potential, work_};
  for (std::size_t k = 0; k < layout.boxes.size(); ++k) {
    const BoxSettings settings{.box = layout.boxes[k],
                               .cell = layout.cell,
                               .spacing = layout.spacing,
                               .split = split_of_box(parameters_, layout.cell, layout.count[k + 1]),
                               .mass_unit = mass_unit};
    fields_[k].add_to(particles, layout.set, static_cast<std::uint8_t>(k + 1), settings, field, stats_);
  }
  const bool all_in_one = stats_.boxes == 1 && layout.count[0] == 0;
  if (!all_in_one) unsplit_.add_to(particles, layout.set, stats_.boxes + 1, mass_unit, field, stats_);
  remove_net_force(particles, acceleration, comm_, stats_);
  stats_.bytes_sent += stats_.phases.bytes_sent;
}

template class TreePm<float>;
template class TreePm<double>;

}  // namespace breccia::gravity

#include "gravity/mesh/tree_pm.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "breccia/error.hpp"
#include "gravity/evaluation.hpp"

namespace breccia::gravity {
namespace {

// A narrower split is beyond what TSC on the mesh resolves.
constexpr double kLeastSplit = 0.6;

// Measured in state (a) of gravity.md 3 at 1.3 true spacings per cell: splits of 0.70, 0.81, 1.05 cells, with cutoffs
// that grow with them, left rms errors of 6.5e-4, 3.8e-4, 1.1e-4. The power of the error goes through these.
double split_for(double error) { return std::clamp(0.8 * std::pow(4.3e-4 / error, 0.21), 0.7, 1.7); }
double cutoff_for(double split) { return std::clamp(4.5 + 2.4 * (split - 0.8), 4.2, 6.5); }

// What the split must leave of Parameters::error in a box of so many particles. Errors are those of near neighbours,
// whose pull compares to the body's as spacing to radius: the same split leaves a third more with a third of the
// particles. More than those of state (a) leave less, which is kept (gravity.md 7). In steps, as kernels are made anew
// for each split.
double share_of_error(std::uint64_t particles) {
  constexpr std::uint64_t kUsual = 65'536;
  return particles >= kUsual ? 1.0 : std::cbrt(static_cast<double>(std::bit_floor(particles)) / kUsual);
}

// Of a box of so many particles, [cells].
GaussianSplit split_of_box(const Parameters& p, double cell, std::uint64_t particles) {
  GaussianSplit split{.softening = p.softening / cell};
  split.scale = p.mesh.split > 0.0 ? p.mesh.split : split_for(p.error * share_of_error(particles));
  split.cutoff = split.scale * (p.mesh.cutoff > 0.0 ? p.mesh.cutoff : cutoff_for(split.scale));
  return split;
}

const Parameters& checked(const Parameters& p) {
  if (p.mesh.split != 0.0 && !(p.mesh.split >= kLeastSplit)) {
    throw UsageError("gravity.split = " + std::to_string(p.mesh.split) + ": must be at least 0.6 mesh cells");
  }
  if (!(p.mesh.cell >= 0.0)) {
    throw UsageError("gravity.mesh = " + std::to_string(p.mesh.cell) + " m: must not be negative");
  }
  fit_short_range<double>(split_of_box(p, 1.0, kLeastBoxParticles));
  return p;
}

}  // namespace

template <class Real>
TreePm<Real>::TreePm(const Parameters& parameters, const mpi::Comm& comm, int threads)
    : parameters_(checked(parameters)),
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

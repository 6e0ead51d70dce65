#include "gravity/tree/tree_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "breccia/constants.hpp"
#include "gravity/evaluation.hpp"
#include "gravity/tree/scales.hpp"

namespace breccia::gravity {
namespace {

// Cube around the particles of all ranks.
Root common_root(ParticlesView particles, const mpi::Comm& comm) {
  constexpr double kFar = std::numeric_limits<double>::max();
  Vec3d low{kFar, kFar, kFar};
  Vec3d high{-kFar, -kFar, -kFar};
  for (const Vec3d& x : particles.position) {
    low = {std::min(low.x, x.x), std::min(low.y, x.y), std::min(low.z, x.z)};
    high = {std::max(high.x, x.x), std::max(high.y, x.y), std::max(high.z, x.z)};
  }
  low = {comm.min(low.x), comm.min(low.y), comm.min(low.z)};
  high = {comm.max(high.x), comm.max(high.y), comm.max(high.z)};
  return low.x <= high.x ? random_root(low, high) : Root{};
}

}  // namespace

TreeSolver::TreeSolver(const Parameters& parameters, const mpi::Comm& comm, int threads)
    : parameters_(parameters), comm_(comm), threads_(std::max(threads, 1)) {}

void TreeSolver::evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) {
  check_sizes(particles, acceleration, potential);
  stats_ = {};
  const Stopwatch whole(stats_.seconds);
  const double mass_unit = heaviest(particles.mass, comm_);
  const Root root = common_root(particles, comm_);
  const double softening = parameters_.softening / root.unit;
  std::vector<double> scales;
  {
    const Stopwatch watch(stats_.build_seconds);
    tree_.sort(root, particles, mass_unit, threads_);
    tree_.build(threads_);
    scales = acceleration_scales(tree_, softening, threads_);
  }
  sums_.reset(tree_.particles.size(), !potential.empty());
  const WalkSettings settings{parameters_.opening, softening, threads_};
  const InteractionCounts counts = parameters_.precision == Precision::kMixed
                                       ? walk<float>(tree_, scales, tree_, settings, sums_)
                                       : walk<double>(tree_, scales, tree_, settings, sums_);
  stats_.pairs = counts.pairs;
  stats_.cell_interactions = counts.cells;
  stats_.expansions = counts.expansions;
  write(kGravitationalConstant * mass_unit, root.unit, acceleration, potential);
  remove_net_force(particles, acceleration, comm_, stats_);
}

void TreeSolver::write(double unit, double length, std::span<Vec3d> acceleration, std::span<double> potential) const {
  const double acceleration_unit = unit / (length * length);
  const auto& order = tree_.particles.order;
  for (std::size_t k = 0; k < order.size(); ++k) {
    acceleration[static_cast<std::size_t>(order[k])] =
        acceleration_unit * Vec3d{sums_.acceleration[0][k], sums_.acceleration[1][k], sums_.acceleration[2][k]};
  }
  if (potential.empty()) return;
  for (std::size_t k = 0; k < order.size(); ++k) {
    potential[static_cast<std::size_t>(order[k])] = unit / length * sums_.potential[k];
  }
}

}  // namespace breccia::gravity

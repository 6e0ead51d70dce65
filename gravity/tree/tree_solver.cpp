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

// Measured in states a and b of gravity.md 3: openings of 1.2e-4, 2e-4, 6e-4, 1e-3 leave rms errors of 2.3e-4, 2.9e-4,
// 5.4e-4, 8.4e-4; few or randomly placed particles have up to half as much again.
double opening_for(const Parameters& parameters) {
  return parameters.opening > 0.0 ? parameters.opening : 1.2e-4 * std::pow(parameters.error / 3.5e-4, 1.9);
}

TreeSolver::TreeSolver(const Parameters& parameters, const mpi::Comm& comm, int threads)
    : parameters_(parameters), comm_(comm), threads_(std::max(threads, 1)) {}

void TreeSolver::evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) {
  check_sizes(particles, acceleration, potential);
  stats_ = {.method = GravityMethod::kTree};
  const Stopwatch whole(stats_.seconds);
  const double mass_unit = heaviest(particles.mass, comm_);
  const Root root = common_root(particles, comm_);
  const double softening = parameters_.softening / root.unit;
  stats_.phases.time(Phase::kSort, [&] {
    build(root, particles, mass_unit);
    take_share();
  });
  const bool with_potential = comm_.any(!potential.empty());
  sums_.reset(tree_.particles.size(), with_potential);
  stats_.phases.time(Phase::kTree, [&] { walk_share(softening); });
  const auto first = static_cast<std::int64_t>(comm_.exclusive_scan(particles.position.size()));
  write(first, kGravitationalConstant * mass_unit, root.unit, acceleration, potential);
  remove_net_force(particles, acceleration, comm_, stats_);
}

void TreeSolver::build(const Root& root, ParticlesView particles, double mass_unit) {
  if (comm_.size() == 1) {
    tree_.sort(root, particles, mass_unit, threads_);
  } else {
    const std::vector<Vec3d> position = comm_.allgather_arrays(particles.position);
    const std::vector<double> mass = comm_.allgather_arrays(particles.mass);
    stats_.bytes_sent += static_cast<double>(comm_.size() - 1) * static_cast<double>(particles.position.size()) *
                         static_cast<double>(sizeof(Vec3d) + sizeof(double));
    tree_.sort(root, {position, mass}, mass_unit, threads_);
  }
  tree_.build(threads_);
}

// Whole groups, in their order along the curve, about as many particles on each rank.
void TreeSolver::take_share() {
  const std::int64_t all = tree_.particles.size();
  share_ = {static_cast<std::int32_t>(all * comm_.rank() / comm_.size()),
            static_cast<std::int32_t>(all * (comm_.rank() + 1) / comm_.size())};
  Range whole_groups{static_cast<std::int32_t>(all), static_cast<std::int32_t>(all)};
  for (const std::int32_t group : tree_.groups()) {
    // Where a group is cut, it belongs to the rank its first particle belongs to.
    const std::int32_t begin = tree_.cell(group).begin;
    if (begin >= share_.begin) whole_groups.begin = std::min(whole_groups.begin, begin);
    if (begin >= share_.end) whole_groups.end = std::min(whole_groups.end, begin);
  }
  share_ = whole_groups;
  for (Cell& cell : tree_.cells) cell.is_target = cell.begin < share_.end && cell.end > share_.begin;
}

void TreeSolver::walk_share(double softening) {
  const std::vector<double> scales = acceleration_scales(tree_, softening, threads_, comm_);
  const WalkSettings settings{opening_for(parameters_), softening, threads_};
  const InteractionCounts counts = parameters_.precision == Precision::kMixed
                                       ? walk<float>(tree_, scales, tree_, settings, sums_)
                                       : walk<double>(tree_, scales, tree_, settings, sums_);
  stats_.pairs = counts.pairs;
  stats_.cell_interactions = counts.cells;
  stats_.expansions = counts.expansions;
  share_sums();
}

// The shares follow each other in rank order.
void TreeSolver::share_sums() {
  if (comm_.size() == 1) return;
  const auto mine = [&](const std::vector<double>& sums) {
    return std::span(sums).subspan(static_cast<std::size_t>(share_.begin),
                                   static_cast<std::size_t>(share_.end - share_.begin));
  };
  for (auto& a : sums_.acceleration) a = comm_.allgather_arrays(mine(a));
  if (!sums_.potential.empty()) sums_.potential = comm_.allgather_arrays(mine(sums_.potential));
  const double components = sums_.potential.empty() ? 3.0 : 4.0;
  stats_.bytes_sent += components * static_cast<double>(comm_.size() - 1) *
                       static_cast<double>(share_.end - share_.begin) * sizeof(double);
}

void TreeSolver::write(std::int64_t first, double unit, double length, std::span<Vec3d> acceleration,
                       std::span<double> potential) const {
  const auto& order = tree_.particles.order;
  const double acceleration_unit = unit / (length * length);
#pragma omp parallel for num_threads(threads_) schedule(static)
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::int64_t here = order[k] - first;
    if (here < 0 || here >= static_cast<std::int64_t>(acceleration.size())) continue;
    const auto i = static_cast<std::size_t>(here);
    acceleration[i] =
        acceleration_unit * Vec3d{sums_.acceleration[0][k], sums_.acceleration[1][k], sums_.acceleration[2][k]};
    if (!potential.empty()) potential[i] = unit / length * sums_.potential[k];
  }
}

}  // namespace breccia::gravity

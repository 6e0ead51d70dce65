#include "gravity/tree/scales.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gravity/tree/workspace.hpp"

namespace breccia::gravity {
namespace {

// One register of targets.
constexpr int kSamples = 16;

// Cells are opened where (b + R)/D exceeds this; three quarters of the fields then are right to a percent.
constexpr double kScaleOpening = 1.0;

struct Sampling {
  Workspace<float> work;
  std::vector<std::int32_t> stack;
  double sums[3][kSamples];
};

bool contains(const Cell& outer, const Cell& inner) {
  return outer.end > outer.begin && outer.begin <= inner.begin && outer.end >= inner.end;
}

// Cells of the coarse tree as the group sees them; the coarse cell it belongs to is left out.
void list_coarse_cells(const Tree& tree, const Cell& group, Sampling& s) {
  const std::int64_t coarse = coarse_limit(tree.all_particles);
  s.work.cells.clear();
  s.stack.assign(1, 0);
  while (!s.stack.empty()) {
    const Cell& cell = tree.cell(s.stack.back());
    s.stack.pop_back();
    const bool own = contains(cell, group);
    if (cell.count > coarse && !cell.is_leaf()) {
      const Vec3d d = group.centre - cell.centre;
      const double size = cell.radius + group.radius;
      if (own || size * size >= kScaleOpening * kScaleOpening * dot(d, d)) {
        for (int c = 0; c < cell.children; ++c) s.stack.push_back(cell.first_child + c);
        continue;
      }
    }
    if (!own) s.work.cells.add(cell, group.centre);
  }
}

double scale_of(const Tree& tree, const Cell& group, double softening, Sampling& s) {
  list_coarse_cells(tree, group, s);
  double position[3][kSamples];
  double mass[kSamples] = {};
  for (int k = 0; k < kSamples; ++k) {
    const Vec3d x = tree.particles.position(group.begin + k * (group.end - group.begin) / kSamples);
    position[0][k] = x.x;
    position[1][k] = x.y;
    position[2][k] = x.z;
  }
  GroupTask<float> task{};
  task.targets = {{position[0], position[1], position[2]}, mass};
  task.end = kSamples;
  task.centre = group.centre;
  task.softening_squared = static_cast<float>(softening * softening);
  for (int axis = 0; axis < 3; ++axis) task.acceleration[axis] = s.sums[axis];
  for (auto& component : s.sums) std::fill(std::begin(component), std::end(component), 0.0);
  s.work.lend_to(task);
  interaction_kernels<float>().evaluate_group(task);

  double least = std::numeric_limits<double>::max();
  for (int k = 0; k < kSamples; ++k) {
    least = std::min(least, std::hypot(s.sums[0][k], s.sums[1][k], s.sums[2][k]));
  }
  const double own = group.radius > 0.0 ? group.moments.mass / (group.radius * group.radius) : 0.0;
  return std::hypot(least, own);
}

}  // namespace

std::vector<double> acceleration_scales(const Tree& tree, double softening, int threads) {
  std::vector<double> scales(tree.cells.size(), 0.0);
  std::vector<std::int32_t> groups, inner;
  if (!tree.cells.empty()) inner.push_back(0);
  for (std::size_t k = 0; k < inner.size(); ++k) {
    const Cell& cell = tree.cell(inner[k]);
    if (cell.is_group() || cell.is_leaf()) {
      groups.push_back(inner[k]);
      continue;
    }
    for (std::int32_t c = cell.first_child; c < cell.first_child + cell.children; ++c) {
      if (tree.cell(c).is_target) inner.push_back(c);
    }
  }
  std::vector<Sampling> sampling(static_cast<std::size_t>(threads));
#pragma omp parallel for num_threads(threads) schedule(dynamic, 16)
  for (std::size_t g = 0; g < groups.size(); ++g) {
    scales[static_cast<std::size_t>(groups[g])] =
        scale_of(tree, tree.cell(groups[g]), softening, sampling[static_cast<std::size_t>(omp_get_thread_num())]);
  }
  // Children stand behind their parents in `inner`.
  for (auto i = inner.rbegin(); i != inner.rend(); ++i) {
    const Cell& cell = tree.cell(*i);
    if (cell.is_group() || cell.is_leaf()) continue;
    double least = std::numeric_limits<double>::max();
    for (std::int32_t c = cell.first_child; c < cell.first_child + cell.children; ++c) {
      if (tree.cell(c).is_target) least = std::min(least, scales[static_cast<std::size_t>(c)]);
    }
    scales[static_cast<std::size_t>(*i)] = least;
  }
  return scales;
}

}  // namespace breccia::gravity

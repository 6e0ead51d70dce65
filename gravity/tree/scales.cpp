#include "gravity/tree/scales.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>

#include "gravity/tree/scale_rules.hpp"
#include "gravity/tree/workspace.hpp"

namespace breccia::gravity {
namespace {

struct Sampling {
  Workspace<float> work;
  std::vector<std::int32_t> stack;
  double sums[3][kScaleSamples];
};

// Cells of the coarse tree only: all ranks know them.
std::vector<std::int32_t> heavy_cells(const Tree& tree) {
  if (tree.cells.empty()) return {};
  const std::int64_t coarse = coarse_limit(tree.all_particles);
  const double least = kHeavy * tree.cell(0).moments.mass;
  std::vector<std::int32_t> heavy, stack{0};
  while (!stack.empty()) {
    const std::int32_t c = stack.back();
    stack.pop_back();
    const Cell& cell = tree.cell(c);
    bool divided = false;
    for (std::int32_t k = cell.first_child; k < cell.first_child + cell.children; ++k) {
      if (tree.cell(k).moments.mass < least || tree.cell(k).count <= coarse) continue;
      stack.push_back(k);
      divided = true;
    }
    if (!divided) heavy.push_back(c);
  }
  return heavy;
}

// The strongest pull of a heavy cell, from where it is farthest.
double least_field(const Tree& tree, std::span<const std::int32_t> heavy, const Cell& group) {
  double field = 0.0;
  for (const std::int32_t c : heavy) field = std::max(field, least_pull(tree.cell(c), group));
  return field;
}

// Cells of the coarse tree as the group sees them; the coarse cell it belongs to is left out.
void list_coarse_cells(const Tree& tree, std::span<const std::int32_t> heavy, const Cell& group, Sampling& s) {
  const double faint = kFaint * least_field(tree, heavy, group);
  const std::int64_t coarse = coarse_limit(tree.all_particles);
  s.work.cells.clear();
  s.stack.assign(1, 0);
  while (!s.stack.empty()) {
    const std::int32_t c = s.stack.back();
    s.stack.pop_back();
    const Cell& cell = tree.cell(c);
    const bool own = contains(cell, group);
    if (cell.count > coarse && !cell.is_leaf() && (own || opened_for_scale(cell, group, faint))) {
      for (int k = 0; k < cell.children; ++k) s.stack.push_back(cell.first_child + k);
      continue;
    }
    if (!own) s.work.cells.push_back(c);
  }
}

double scale_of(const Tree& tree, std::span<const std::int32_t> heavy, const Cell& group, double softening,
                Sampling& s) {
  list_coarse_cells(tree, heavy, group, s);
  double position[3][kScaleSamples];
  double mass[kScaleSamples] = {};
  for (int k = 0; k < kScaleSamples; ++k) {
    const Vec3d x = tree.particles.position(group.begin + k * (group.end - group.begin) / kScaleSamples);
    position[0][k] = x.x;
    position[1][k] = x.y;
    position[2][k] = x.z;
  }
  GroupTask<float> task{};
  task.targets = {{position[0], position[1], position[2]}, mass};
  task.end = kScaleSamples;
  task.centre = group.centre;
  task.softening_squared = static_cast<float>(softening * softening);
  for (int axis = 0; axis < 3; ++axis) task.acceleration[axis] = s.sums[axis];
  for (auto& component : s.sums) std::fill(std::begin(component), std::end(component), 0.0);
  s.work.lend_to(task, tree);
  interaction_kernels<float>().evaluate_group(task);

  double least = std::numeric_limits<double>::max();
  for (int k = 0; k < kScaleSamples; ++k) {
    least = std::min(least, std::hypot(s.sums[0][k], s.sums[1][k], s.sums[2][k]));
  }
  return least;
}

}  // namespace

std::vector<double> acceleration_scales(const Tree& tree, std::span<const Cell> others, double softening, int threads) {
  std::vector<std::int32_t> targets = tree.groups();
  std::erase_if(targets, [&](std::int32_t g) { return !tree.cell(g).is_target; });
  std::vector<double> scales(tree.cells.size(), std::numeric_limits<double>::max());
  const std::vector<std::int32_t> heavy = heavy_cells(tree);
  std::vector<Sampling> sampling(static_cast<std::size_t>(threads));
#pragma omp parallel for num_threads(threads) schedule(dynamic, 16)
  for (std::size_t g = 0; g < targets.size(); ++g) {
    const Cell& group = tree.cell(targets[g]);
    double scale = scale_of(tree, heavy, group, softening, sampling[static_cast<std::size_t>(omp_get_thread_num())]);
    for (const Cell& other : others) scale = std::max(scale, pull_of_whole(other, group));
    scales[static_cast<std::size_t>(targets[g])] = scale;
  }
  for (std::size_t i = 0; i < tree.cells.size(); ++i) {  // parents come first
    const Cell& cell = tree.cells[i];
    for (std::int32_t c = 0; c < cell.children && cell.is_group(); ++c) {
      scales[static_cast<std::size_t>(cell.first_child + c)] = scales[i];
    }
  }
  take_least_of_children(tree, scales.size(), scales);
  return scales;
}

void take_least_of_children(const Tree& tree, std::size_t count, std::vector<double>& scales) {
  for (std::size_t i = count; i-- > 0;) {
    const Cell& cell = tree.cells[i];
    if (cell.is_group()) continue;
    double least = std::numeric_limits<double>::max();
    for (std::int32_t c = cell.first_child; c < cell.first_child + cell.children; ++c) {
      least = std::min(least, scales[static_cast<std::size_t>(c)]);
    }
    scales[i] = least;
  }
}

}  // namespace breccia::gravity

#include "gravity/tree/shared_tree.hpp"

#include <algorithm>
#include <cmath>

#include "gravity/tree/opening.hpp"
#include "gravity/tree/scales.hpp"

namespace breccia::gravity {

void SharedTree::build(const Root& root, ParticlesView particles, double mass_unit) {
  bytes_sent_ = 0.0;
  leaves_.clear();
  top_.clear();
  home_.clear();
  tree_.sort(root, particles, mass_unit, threads_);
  if (comm_.size() == 1) {
    tree_.build(threads_);
    return;
  }
  grow_top();
  if (tree_.cells.empty()) return;
  list_leaves();
  gather_groups();
  grow_below();
  share_moments();
  enclose_top();
}

void SharedTree::grow_below() {
  std::vector<std::int32_t> own;
  for (const TopLeaf& leaf : leaves_) {
    if (leaf.owner == comm_.rank()) {
      own.push_back(leaf.cell);
    } else {
      tree_.cells[static_cast<std::size_t>(leaf.cell)].children = kUnknownChildren;
    }
  }
  tree_.grow(own, threads_);
}

void SharedTree::share_moments() {
  struct Summary {
    std::int32_t cell;
    double radius;
    Vec3d centre;
    Moments<double> moments;
  };
  std::vector<Summary> mine;
  for (const TopLeaf& leaf : leaves_) {
    if (leaf.owner != comm_.rank()) continue;
    const Cell& c = tree_.cell(leaf.cell);
    mine.push_back({leaf.cell, c.radius, c.centre, c.moments});
  }
  bytes_sent_ += static_cast<double>(mine.size() * sizeof(Summary)) * (comm_.size() - 1);
  for (const Summary& s : comm_.allgather_arrays(std::span<const Summary>(mine))) {
    Cell& c = tree_.cells[static_cast<std::size_t>(s.cell)];
    c.radius = s.radius;
    c.centre = s.centre;
    c.moments = s.moments;
  }
}

// Of the particles in a leaf, how far those that share interactions reach.
double SharedTree::reach_of(const Cell& leaf) const {
  double reach = leaf.radius;
  std::vector<std::int32_t> stack;
  const auto push_children = [&](const Cell& c) {
    for (std::int32_t k = 0; k < c.children && !c.is_smallest_group(); ++k) stack.push_back(c.first_child + k);
  };
  push_children(leaf);
  while (!stack.empty()) {
    const Cell& c = tree_.cell(stack.back());
    stack.pop_back();
    const Vec3d d = c.centre - leaf.centre;
    reach = std::max(reach, std::sqrt(dot(d, d)) + c.radius);
    push_children(c);
  }
  return reach;
}

double SharedTree::largest_density() const {
  double largest = 0.0;
  for (const Cell& c : tree_.cells) {
    if (c.count > kSparseGroupParticles) largest = std::max(largest, density(c));
  }
  return comm_.max(largest);
}

void SharedTree::set_scales(std::span<const Cell> others, double softening, double densest) {
  scales_ = acceleration_scales(tree_, others, softening, threads_);
  if (comm_.size() == 1) return;
  struct LeafScale {
    std::int64_t number;
    double scale, reach;
    bool may_be_divided;
  };
  std::vector<LeafScale> mine;
  for (std::size_t l = 0; l < leaves_.size(); ++l) {
    if (leaves_[l].owner != comm_.rank()) continue;
    const std::int32_t cell = leaves_[l].cell;
    const Cell& leaf = tree_.cell(cell);
    mine.push_back({static_cast<std::int64_t>(l), scales_[static_cast<std::size_t>(cell)], reach_of(leaf),
                    leaf.is_group() && !leaf.is_smallest_group() && kDenser * density(leaf) <= densest});
  }
  bytes_sent_ += static_cast<double>(mine.size() * sizeof(LeafScale)) * (comm_.size() - 1);
  for (const LeafScale& s : comm_.allgather_arrays(std::span<const LeafScale>(mine))) {
    TopLeaf& leaf = leaves_[static_cast<std::size_t>(s.number)];
    scales_[static_cast<std::size_t>(leaf.cell)] = s.scale;
    leaf.reach = s.reach;
    leaf.may_be_divided = s.may_be_divided;
  }
  take_least_of_children(tree_, top_.size(), scales_);
}

}  // namespace breccia::gravity

// The particles near a group: what a short-range force sums over.
#pragma once

#include <cstdint>
#include <vector>

#include "gravity/tree/tree.hpp"
#include "gravity/tree/workspace.hpp"

namespace breccia::gravity {

/// Replaces work.ranges by the leaves of `sources` that may hold a particle within `cutoff` [Root::unit] of one of the
/// `group`; where `group` is of the same tree, its own particles come first (GroupTask::self).
template <class Real>
void list_near(const Tree& sources, const Cell& group, bool same_tree, double cutoff, std::vector<std::int32_t>& stack,
               Workspace<Real>& work) {
  work.cells.clear();
  work.ranges.clear();
  if (same_tree) work.ranges.push_back({group.begin, group.end});
  stack.clear();
  if (!sources.cells.empty()) stack.push_back(0);
  while (!stack.empty()) {
    const Cell& cell = sources.cell(stack.back());
    stack.pop_back();
    if (same_tree && cell.begin >= group.begin && cell.end <= group.end) continue;
    const Vec3d d = cell.centre - group.centre;
    const double reach = cutoff + cell.radius + group.radius;
    if (dot(d, d) > reach * reach) continue;
    if (cell.is_leaf()) {
      work.add_range(cell.begin, cell.end);
    } else {
      for (std::int32_t c = cell.first_child + cell.children; c-- > cell.first_child;) stack.push_back(c);
    }
  }
}

}  // namespace breccia::gravity

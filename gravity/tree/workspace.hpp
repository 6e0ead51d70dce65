// What one thread needs to sum over a group: lists that keep their memory from group to group.
#pragma once

#include <algorithm>
#include <vector>

#include "gravity/tree/interactions.hpp"
#include "gravity/tree/tree.hpp"

namespace breccia::gravity {

inline CellRefs refs(const std::vector<std::int32_t>& list, const Tree& tree) {
  return {tree.cells.data(), list.data(), static_cast<std::int64_t>(list.size())};
}

template <class Real>
struct Workspace {
  std::vector<std::int32_t> cells;
  std::vector<Range> ranges;
  std::vector<Real> reals;
  std::vector<double> doubles;

  /// Appends a range of sources, joined to the last one where they touch.
  void add_range(std::int32_t begin, std::int32_t end) {
    if (!ranges.empty() && ranges.back().end == begin) {
      ranges.back().end = end;
    } else {
      ranges.push_back({begin, end});
    }
  }
  /// Lets `task` use the lists, of cells of `tree`, and enough memory.
  void lend_to(GroupTask<Real>& task, const Tree& tree) {
    std::int64_t sources = 0;
    for (const Range r : ranges) sources += r.end - r.begin;
    task.cells = refs(cells, tree);
    task.ranges = ranges.data();
    task.range_count = static_cast<std::int64_t>(ranges.size());
    const std::int64_t targets = task.end - task.begin;
    reals.resize(std::max(reals.size(), static_cast<std::size_t>(reals_needed(targets, sources))));
    doubles.resize(std::max(doubles.size(), static_cast<std::size_t>(doubles_needed(targets))));
    task.reals = reals.data();
    task.doubles = doubles.data();
  }
};

inline MassArrays mass_arrays(const SortedParticles& p) {
  return {{p.x.data(), p.y.data(), p.z.data()}, p.mass.data()};
}

}  // namespace breccia::gravity

// What one thread needs to sum over a group: lists that keep their memory from group to group.
#pragma once

#include <algorithm>
#include <vector>

#include "gravity/tree/interactions.hpp"
#include "gravity/tree/tree.hpp"

namespace breccia::gravity {

/// Distant cells as the kernels read them.
template <class Real>
class CellList {
 public:
  void clear() {
    for (auto& c : component_) c.clear();
  }
  /// `cell` as seen from `origin`.
  void add(const Cell& cell, Vec3d origin) {
    const Vec3d x = cell.centre - origin;
    const Moments<double>& m = cell.moments;
    const double values[kCellComponents] = {x.x,         x.y,         x.z,         m.mass,      m.second.xx,
                                            m.second.yy, m.second.zz, m.second.xy, m.second.xz, m.second.yz};
    for (int c = 0; c < kCellComponents; ++c) component_[c].push_back(static_cast<Real>(values[c]));
  }
  /// Fills up to a whole number of registers with massless cells one unit away.
  void pad() {
    const auto size = static_cast<std::size_t>(lane_padded(static_cast<std::int64_t>(component_[0].size())));
    for (int c = 0; c < kCellComponents; ++c) component_[c].resize(size, Real(c == 0 ? 1 : 0));
  }
  [[nodiscard]] CellArrays<Real> arrays() const {
    CellArrays<Real> a{};
    for (int c = 0; c < kCellComponents; ++c) a.component[c] = component_[c].data();
    a.count = static_cast<std::int64_t>(component_[0].size());
    return a;
  }

 private:
  std::vector<Real> component_[kCellComponents];
};

template <class Real>
struct Workspace {
  CellList<Real> cells;
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
  /// Lets `task` use the lists and enough memory.
  void lend_to(GroupTask<Real>& task) {
    std::int64_t sources = 0;
    for (const Range r : ranges) sources += r.end - r.begin;
    task.cells = cells.arrays();
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

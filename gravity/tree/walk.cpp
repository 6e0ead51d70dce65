#include "gravity/tree/walk.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>

#include "gravity/tree/opening.hpp"
#include "gravity/tree/workspace.hpp"

namespace breccia::gravity {
namespace {

// Target cells of fewer particles than this share of all are walked as one piece of parallel work.
constexpr std::int64_t kBranches = 128;

// Costs in units of a pair (gravity.md 2: 5.85, 2.69 and 1.27 G/s), for the work of particles.
constexpr double kCellCost = 2.2;
constexpr double kExpansionCost = 4.6;

// A group whose sources reach this many times the distance of its closest neighbours needs two floats per coordinate;
// one would be off by 1e-4 of that distance.
constexpr double kWideGroup = 2048.0;

// Sources still to be placed, as positions in a list that grows and shrinks with the depth of the walk.
struct Candidates {
  std::size_t begin, end;
};

// One thread's lists.
template <class Real>
struct Walking {
  Workspace<Real> work;
  std::vector<std::int32_t> candidates, expansions;
  std::vector<std::int32_t> level, opened, leaves;
  std::vector<Opening> how;
  double spread = 0.0;  ///< expansions above this group, in pairs per particle
  double reach = 0.0;   ///< farthest particle among the sources of this group, from its centre
  InteractionCounts counts;

  void start(Candidates from) {
    const auto first = candidates.begin();
    level.assign(first + static_cast<std::ptrdiff_t>(from.begin), first + static_cast<std::ptrdiff_t>(from.end));
  }
};

// Appends up to n cells to a list without asking for room. Which list a cell goes to nobody could predict: chosen from
// an array, it costs no branch.
class Appender {
 public:
  Appender(std::vector<std::int32_t>& list, std::size_t n) : list_(list) {
    const std::size_t size = list.size();
    list.resize(size + n);
    end_ = list.data() + size;
  }
  Appender(const Appender&) = delete;
  Appender& operator=(const Appender&) = delete;
  ~Appender() { list_.resize(static_cast<std::size_t>(end_ - list_.data())); }

  void add(std::int32_t cell) { *end_++ = cell; }

 private:
  std::vector<std::int32_t>& list_;
  std::int32_t* end_;
};

// A target cell with all it needs to be walked on its own.
struct Branch {
  std::int32_t cell;
  std::vector<std::int32_t> candidates;
  LocalExpansion<double> far;
  double spread;
};

bool lies_in(const Cell& inner, const Cell& outer) {
  return inner.begin >= outer.begin && inner.end <= outer.end && inner.end > inner.begin;
}

template <class Real>
class Walker {
 public:
  Walker(const Tree& targets, const std::vector<double>& scales, const Tree& sources, const WalkSettings& settings,
         FieldSums& sums)
      : targets_(targets), scales_(scales), sources_(sources), settings_(settings), sums_(sums) {}

  InteractionCounts run() {
    if (targets_.cells.empty() || sources_.cells.empty() || !targets_.cell(0).is_target) return {};
    Walking<Real> trunk;
    branch_limit_ = targets_.all_particles / kBranches;
    trunk.candidates.push_back(0);
    descend(trunk, 0, {0, 1}, {}, true);

    std::vector<Walking<Real>> walking(static_cast<std::size_t>(settings_.threads));
#pragma omp parallel for num_threads(settings_.threads) schedule(dynamic)
    for (const Branch& branch : branches_) {
      Walking<Real>& mine = walking[static_cast<std::size_t>(omp_get_thread_num())];
      mine.candidates = branch.candidates;
      mine.spread = branch.spread;
      descend(mine, branch.cell, {0, mine.candidates.size()}, branch.far, false);
    }
    InteractionCounts counts = trunk.counts;
    for (const Walking<Real>& w : walking) counts += w.counts;
    return counts;
  }

 private:
  [[nodiscard]] double largest_error(std::int32_t t) const {
    return settings_.tolerance * scales_[static_cast<std::size_t>(t)];
  }
  [[nodiscard]] Real softening_squared() const { return static_cast<Real>(settings_.softening * settings_.softening); }

  // `in_trunk`: stops at cells small enough to be branches, and keeps those for later.
  void descend(Walking<Real>& w, std::int32_t t, Candidates from, const LocalExpansion<double>& far, bool in_trunk) {
    const Cell& cell = targets_.cell(t);
    if (in_trunk && (cell.is_group() || cell.count <= branch_limit_)) {
      const auto list = w.candidates.begin();
      branches_.push_back(
          {t,
           {list + static_cast<std::ptrdiff_t>(from.begin), list + static_cast<std::ptrdiff_t>(from.end)},
           far,
           w.spread});
      return;
    }
    if (cell.is_group() && !is_sparse(w, cell, from)) return sum_group(w, t, from, far);
    LocalExpansion<double> own = far;
    const double spread = w.spread;
    const Candidates rest = separate(w, t, from, own);
    for (std::int32_t c = cell.first_child; c < cell.first_child + cell.children; ++c) {
      const Cell& child = targets_.cell(c);
      if (child.is_target) descend(w, c, rest, shifted(own, child.centre - cell.centre), in_trunk);
    }
    w.candidates.resize(rest.begin);
    w.spread = spread;
  }

  // Whether the group is to be divided: something larger near it is denser by far.
  [[nodiscard]] bool is_sparse(const Walking<Real>& w, const Cell& group, Candidates from) const {
    if (group.is_smallest_group()) return false;
    const auto first = w.candidates.begin();
    return std::any_of(first + static_cast<std::ptrdiff_t>(from.begin), first + static_cast<std::ptrdiff_t>(from.end),
                       [&](std::int32_t s) { return outweighs(sources_.cell(s), group); });
  }

  // How each of the cells in w.level is to be taken.
  void decide(Walking<Real>& w, const Cell& target, double allowed) const {
    w.how.resize(w.level.size());
    kernels_.decide({refs(w.level, sources_), &target, allowed, w.how.data()});
  }

  // The children of w.opened are the next level.
  void open(Walking<Real>& w) const {
    w.level.clear();
    for (const std::int32_t s : w.opened) {
      const Cell& parent = sources_.cell(s);
      for (std::int32_t c = parent.first_child; c < parent.first_child + parent.children; ++c) w.level.push_back(c);
    }
    w.opened.clear();
  }

  // Expands the candidates that are far enough, or their parts, around cell t; returns the others.
  Candidates separate(Walking<Real>& w, std::int32_t t, Candidates from, LocalExpansion<double>& far) const {
    const Cell& target = targets_.cell(t);
    const std::size_t begin = w.candidates.size();
    w.expansions.clear();
    for (w.start(from); !w.level.empty(); open(w)) {
      decide(w, target, largest_error(t));
      const std::size_t n = w.level.size();
      Appender lists[3] = {{w.opened, n}, {w.candidates, n}, {w.expansions, n}};
      for (std::size_t k = 0; k < n; ++k) {
        const Cell& source = sources_.cell(w.level[k]);
        const bool expand = w.how[k] == Opening::kExpand;
        const bool keep = source.is_leaf() | (source.radius < target.radius);
        lists[expand ? 2 : int{keep}].add(w.level[k]);
      }
    }
    expand_listed(w, target, far);
    w.spread += kExpansionCost * static_cast<double>(w.expansions.size()) / static_cast<double>(target.count);
    return {begin, w.candidates.size()};
  }

  void expand_listed(Walking<Real>& w, const Cell& target, LocalExpansion<double>& far) const {
    w.counts.expansions += static_cast<double>(w.expansions.size());
    if (w.expansions.empty()) return;
    kernels_.expand({refs(w.expansions, sources_), target.centre, softening_squared(), &far});
  }

  // Everything that is left acts on the group's particles directly.
  void sum_group(Walking<Real>& w, std::int32_t t, Candidates from, LocalExpansion<double> far) const {
    const Cell& group = targets_.cell(t);
    const bool same = &targets_ == &sources_;
    w.work.cells.clear();
    w.work.ranges.clear();
    w.expansions.clear();
    w.reach = group.radius;
    if (same) w.work.ranges.push_back({group.begin, group.end});
    list_sources(w, t, from, same);
    expand_listed(w, group, far);

    GroupTask<Real> task{};
    task.targets = mass_arrays(targets_.particles);
    task.begin = group.begin;
    task.end = group.end;
    task.centre = group.centre;
    task.far = &far;
    task.sources = mass_arrays(sources_.particles);
    task.self = same;
    task.split_coordinates = needs_two_floats(group, w.reach);
    task.softening_squared = softening_squared();
    for (int axis = 0; axis < 3; ++axis) task.acceleration[axis] = sums_.acceleration[axis].data();
    task.potential = sums_.potential.empty() ? nullptr : sums_.potential.data();
    w.work.lend_to(task, sources_);
    kernels_.evaluate_group(task);
    book(w, task);
  }

  void list_sources(Walking<Real>& w, std::int32_t t, Candidates from, bool same) const {
    const Cell& group = targets_.cell(t);
    w.leaves.clear();
    for (w.start(from); !w.level.empty(); open(w)) {
      if (same) {
        std::erase_if(w.level, [&](std::int32_t s) { return lies_in(sources_.cell(s), group); });
      }
      decide(w, group, largest_error(t));
      const std::size_t n = w.level.size();
      Appender lists[4] = {{w.opened, n}, {w.work.cells, n}, {w.expansions, n}, {w.leaves, n}};
      for (std::size_t k = 0; k < n; ++k) {
        const Cell& source = sources_.cell(w.level[k]);
        const Opening how = source.count > kFewParticles ? w.how[k] : Opening::kOpen;
        const bool missing = source.has_unknown_parts() & (how == Opening::kOpen);
        const bool leaf = source.is_leaf() & (how == Opening::kOpen);
        w.counts.missing += missing ? 1.0 : 0.0;
        lists[missing ? 1 : leaf ? 3 : static_cast<int>(how)].add(w.level[k]);
      }
    }
    for (const std::int32_t s : w.leaves) {
      const Cell& source = sources_.cell(s);
      w.work.add_range(source.begin, source.end);
      const Vec3d d = source.centre - group.centre;
      w.reach = std::max(w.reach, std::sqrt(dot(d, d)) + source.radius);
    }
  }

  // Neighbours on the curve are neighbours in space often enough to tell how close the closest particles come.
  [[nodiscard]] bool needs_two_floats(const Cell& group, double reach) const {
    const SortedParticles& p = targets_.particles;
    double closest = reach * reach;
    for (std::int64_t i = group.begin + 1; i < group.end; ++i) {
      const Vec3d d = p.position(i) - p.position(i - 1);
      const double d2 = dot(d, d);
      if (d2 > 0.0) closest = std::min(closest, d2);
    }
    const double resolved = reach / kWideGroup;
    return closest + settings_.softening * settings_.softening < resolved * resolved;
  }

  void book(Walking<Real>& w, const GroupTask<Real>& task) const {
    const auto targets = static_cast<double>(task.end - task.begin);
    std::int64_t sources = 0;
    for (const Range r : w.work.ranges) sources += r.end - r.begin;
    w.counts.pairs += targets * static_cast<double>(sources);
    w.counts.cells += targets * static_cast<double>(task.cells.count);
    const double each = static_cast<double>(sources) + kCellCost * static_cast<double>(task.cells.count) + w.spread +
                        kExpansionCost * static_cast<double>(w.expansions.size()) / targets;
    for (std::int64_t i = task.begin; i < task.end; ++i) sums_.work[static_cast<std::size_t>(i)] += each;
  }

  const InteractionKernels<Real>& kernels_ = interaction_kernels<Real>();
  const Tree& targets_;
  const std::vector<double>& scales_;
  const Tree& sources_;
  WalkSettings settings_;
  FieldSums& sums_;
  std::int64_t branch_limit_ = 0;
  std::vector<Branch> branches_;
};

}  // namespace

void FieldSums::reset(std::int64_t particles, bool with_potential) {
  const auto n = static_cast<std::size_t>(particles);
  for (auto& a : acceleration) a.assign(n, 0.0);
  potential.assign(with_potential ? n : 0, 0.0);
  work.assign(n, 0.0);
}

InteractionCounts& InteractionCounts::operator+=(const InteractionCounts& b) {
  pairs += b.pairs;
  cells += b.cells;
  expansions += b.expansions;
  missing += b.missing;
  return *this;
}

template <class Real>
InteractionCounts walk(const Tree& targets, const std::vector<double>& scales, const Tree& sources,
                       const WalkSettings& settings, FieldSums& sums) {
  return Walker<Real>(targets, scales, sources, settings, sums).run();
}
template InteractionCounts walk<float>(const Tree&, const std::vector<double>&, const Tree&, const WalkSettings&,
                                       FieldSums&);
template InteractionCounts walk<double>(const Tree&, const std::vector<double>&, const Tree&, const WalkSettings&,
                                        FieldSums&);

}  // namespace breccia::gravity

#include "gravity/tree/shared_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "gravity/tree/opening.hpp"
#include "gravity/tree/scales.hpp"

namespace breccia::gravity {
// What all ranks together have in some cells.
class SharedTree::Census {
 public:
  Census(std::size_t cells, const mpi::Comm& comm) : comm_(comm), counts_(cells, 0), maxima_(3 * cells, 0) {}

  // Particles [begin, end) of this rank.
  void enter(std::size_t cell, std::int64_t begin, std::int64_t end, const std::vector<std::uint64_t>& key) {
    if (end == begin) return;
    const auto ranks = static_cast<std::uint64_t>(comm_.size());
    counts_[cell] = end - begin;
    maxima_[3 * cell] = key[static_cast<std::size_t>(end) - 1];
    maxima_[3 * cell + 1] = ~key[static_cast<std::size_t>(begin)];
    // Of ranks with equally many the first.
    maxima_[3 * cell + 2] =
        static_cast<std::uint64_t>(end - begin) * ranks + (ranks - 1 - static_cast<std::uint64_t>(comm_.rank()));
  }
  void take() {
    comm_.sum(std::span<std::int64_t>(counts_));
    comm_.max(std::span<std::uint64_t>(maxima_));
  }
  [[nodiscard]] std::int64_t count(std::size_t cell) const { return counts_[cell]; }
  [[nodiscard]] TopCell top_cell(std::size_t cell) const {
    const auto ranks = static_cast<std::uint64_t>(comm_.size());
    const std::uint64_t most = maxima_[3 * cell + 2];
    return {~maxima_[3 * cell + 1], maxima_[3 * cell], static_cast<std::int32_t>(ranks - 1 - most % ranks),
            static_cast<std::int64_t>(most / ranks) < counts_[cell]};
  }
  [[nodiscard]] double bytes() const { return 32.0 * static_cast<double>(counts_.size()); }

 private:
  const mpi::Comm& comm_;
  std::vector<std::int64_t> counts_;
  std::vector<std::uint64_t> maxima_;  // highest key, complement of the lowest, most particles and the rank with them
};

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

// Level by level; how a cell splits follows from what all ranks have in it.
void SharedTree::grow_top() {
  tree_.cells.clear();
  const auto& key = tree_.particles.key;
  const auto mine = static_cast<std::int64_t>(key.size());
  Census all(1, comm_);
  all.enter(0, 0, mine, key);
  all.take();
  tree_.all_particles = all.count(0);
  if (all.count(0) == 0) return;
  Cell root;
  root.count = all.count(0);
  root.end = static_cast<std::int32_t>(mine);
  tree_.cells.push_back(root);
  top_.push_back(all.top_cell(0));

  // Needs below the leaves are bounded, not known: were leaves of debris as wide as a body, all of it would be sent.
  const std::int64_t limit = std::max(kGroupParticles, root.count / top_leaves_);
  std::size_t level = 0;
  while (level < top_.size()) {
    std::vector<std::size_t> frontier;
    const std::size_t end = top_.size();
    for (; level < end; ++level) {
      const std::int64_t count = tree_.cells[level].count;
      const bool shared = count > limit || (top_[level].divided && count > kGroupParticles);
      if (shared && split_of_top(level).bits > 0) frontier.push_back(level);
    }
    if (!frontier.empty()) split_top(frontier);
  }
}

Split SharedTree::split_of_top(std::size_t cell) const {
  return split_of(tree_.cells[cell].count, tree_.cells[cell].key_bits, top_[cell].low, top_[cell].high);
}

void SharedTree::split_top(std::span<const std::size_t> frontier) {
  const auto& key = tree_.particles.key;
  Census census(kMostChildren * frontier.size(), comm_);
  std::vector<std::array<std::int32_t, kMostChildren + 1>> bounds(frontier.size());
  for (std::size_t f = 0; f < frontier.size(); ++f) {
    const Cell& parent = tree_.cells[frontier[f]];
    const Split s = split_of_top(frontier[f]);
    const int shift = kKeyBits - s.start - s.bits;
    const std::uint64_t mask = (std::uint64_t{1} << s.bits) - 1;
    bounds[f].fill(parent.end);
    std::int32_t at = parent.begin;
    for (std::size_t v = 0; v <= mask; ++v) {
      bounds[f][v] = at;
      const auto next = std::partition_point(key.begin() + at, key.begin() + parent.end,
                                             [&](std::uint64_t k) { return ((k >> shift) & mask) <= v; });
      at = static_cast<std::int32_t>(next - key.begin());
      census.enter(kMostChildren * f + v, bounds[f][v], at, key);
    }
  }
  census.take();
  bytes_sent_ += census.bytes();
  for (std::size_t f = 0; f < frontier.size(); ++f) {
    const Split s = split_of_top(frontier[f]);
    tree_.cells[frontier[f]].first_child = static_cast<std::int32_t>(tree_.cells.size());
    for (std::size_t v = 0; v < kMostChildren; ++v) {
      const std::size_t slot = kMostChildren * f + v;
      if (census.count(slot) == 0) continue;
      Cell child;
      child.begin = bounds[f][v];
      child.end = bounds[f][v + 1];
      child.count = census.count(slot);
      child.key_bits = s.start + s.bits;
      ++tree_.cells[frontier[f]].children;
      tree_.cells.push_back(child);
      top_.push_back(census.top_cell(slot));
    }
  }
}

void SharedTree::list_leaves() {
  std::vector<std::int32_t> stack{0};
  while (!stack.empty()) {
    const std::int32_t i = stack.back();
    stack.pop_back();
    const Cell& c = tree_.cell(i);
    if (c.children == 0) leaves_.push_back({i, top_[static_cast<std::size_t>(i)].owner, false, 0.0});
    for (std::int32_t k = c.children; k-- > 0;) stack.push_back(c.first_child + k);
  }
}

// Sends the particles in leaves of other ranks there.
void SharedTree::gather_groups() {
  const SortedParticles& p = tree_.particles;
  std::vector<std::vector<Traveller>> to(static_cast<std::size_t>(comm_.size()));
  for (std::size_t n = 0; n < leaves_.size(); ++n) {
    const Cell& leaf = tree_.cell(leaves_[n].cell);
    if (leaves_[n].owner == comm_.rank()) continue;
    for (std::int64_t i = leaf.begin; i < leaf.end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      to[static_cast<std::size_t>(leaves_[n].owner)].push_back(
          {p.position(i), p.mass[k], p.key[k], p.order[k], static_cast<std::int32_t>(n), comm_.rank()});
    }
  }
  for (const auto& t : to) bytes_sent_ += static_cast<double>(t.size() * sizeof(Traveller));
  std::vector<std::vector<Traveller>> of_leaf(leaves_.size());
  for (const std::vector<Traveller>& from : comm_.alltoall(to)) {
    for (const Traveller& t : from) of_leaf[static_cast<std::size_t>(t.leaf)].push_back(t);
  }
  sort_by_leaves(of_leaf);
}

// Particles are left in the order of the leaves of this rank, with those that arrived, and of their keys.
void SharedTree::sort_by_leaves(std::vector<std::vector<Traveller>>& arrived) {
  const SortedParticles from = std::move(tree_.particles);
  SortedParticles& to = tree_.particles;
  to = {};
  std::vector<std::int32_t> home;
  const std::size_t n = from.key.size();
  for (auto* component : {&to.x, &to.y, &to.z, &to.mass}) component->reserve(n);
  const auto put = [&](Vec3d position, double mass, std::uint64_t key, std::int64_t index, std::int32_t rank) {
    to.append(position, mass);
    to.key.push_back(key);
    to.order.push_back(index);
    home.push_back(rank);
  };
  for (std::size_t l = 0; l < leaves_.size(); ++l) {
    Cell& leaf = tree_.cells[static_cast<std::size_t>(leaves_[l].cell)];
    const std::int32_t begin = leaf.begin, end = leaf.end;
    leaf.begin = static_cast<std::int32_t>(to.key.size());
    if (leaves_[l].owner == comm_.rank()) {
      std::vector<Traveller>& others = arrived[l];
      if (others.empty()) {
        for (std::int64_t i = begin; i < end; ++i) {
          const auto k = static_cast<std::size_t>(i);
          put(from.position(i), from.mass[k], from.key[k], from.order[k], comm_.rank());
        }
      } else {
        for (std::int64_t i = begin; i < end; ++i) {
          const auto k = static_cast<std::size_t>(i);
          others.push_back({from.position(i), from.mass[k], from.key[k], from.order[k], 0, comm_.rank()});
        }
        std::stable_sort(others.begin(), others.end(),
                         [](const Traveller& a, const Traveller& b) { return a.key < b.key; });
        for (const Traveller& t : others) put(t.position, t.mass, t.key, t.index, t.home);
      }
    }
    leaf.end = static_cast<std::int32_t>(to.key.size());
  }
  home_ = std::move(home);
  for (std::size_t i = tree_.cells.size(); i-- > 0;) {
    Cell& c = tree_.cells[i];
    if (c.children > 0) {
      c.begin = tree_.cell(c.first_child).begin;
      c.end = tree_.cell(c.first_child + c.children - 1).end;
    }
    c.is_target = c.end > c.begin;
  }
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

// The inner cells of the top, with the radius that a single rank would find.
void SharedTree::enclose_top() {
  // A leaf of the top may have children on its rank.
  std::vector<bool> is_leaf(top_.size(), false);
  for (const TopLeaf& leaf : leaves_) is_leaf[static_cast<std::size_t>(leaf.cell)] = true;
  std::vector<double> farthest(top_.size(), 0.0);
  for (std::size_t i = top_.size(); i-- > 0;) {
    Cell& c = tree_.cells[i];
    if (is_leaf[i]) continue;
    tree_.combine_children(c);
    if (c.count <= kExactRadius) farthest[i] = tree_.farthest_squared(c);
  }
  comm_.max(std::span<double>(farthest));
  // Larger cells once more, over the final radii of their children.
  for (std::size_t i = top_.size(); i-- > 0;) {
    Cell& c = tree_.cells[i];
    if (is_leaf[i]) continue;
    if (c.count <= kExactRadius) {
      c.radius = enclosing_radius(farthest[i]);
    } else {
      tree_.combine_children(c);
    }
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

FieldSums SharedTree::bring_home(const FieldSums& sums, std::vector<std::int64_t>& index) {
  struct Result {
    std::int64_t index;
    Vec3d acceleration;
    double potential, work;
  };
  const bool with_potential = !sums.potential.empty();
  std::vector<std::vector<Result>> to(static_cast<std::size_t>(comm_.size()));
  for (std::size_t k = 0; k < home_.size(); ++k) {
    if (home_[k] == comm_.rank()) continue;
    const Vec3d a{sums.acceleration[0][k], sums.acceleration[1][k], sums.acceleration[2][k]};
    to[static_cast<std::size_t>(home_[k])].push_back(
        {tree_.particles.order[k], a, with_potential ? sums.potential[k] : 0.0, sums.work[k]});
  }
  for (const auto& t : to) bytes_sent_ += static_cast<double>(t.size() * sizeof(Result));
  FieldSums home;
  home.reset(0, with_potential);
  index.clear();
  for (const std::vector<Result>& from : comm_.alltoall(to)) {
    for (const Result& r : from) {
      index.push_back(r.index);
      home.acceleration[0].push_back(r.acceleration.x);
      home.acceleration[1].push_back(r.acceleration.y);
      home.acceleration[2].push_back(r.acceleration.z);
      home.potential.push_back(r.potential);
      home.work.push_back(r.work);
    }
  }
  return home;
}

}  // namespace breccia::gravity

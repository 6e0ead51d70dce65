// The top of a shared tree: cells that all ranks know, from what they together have in them.
#include <algorithm>
#include <array>

#include "gravity/tree/shared_tree.hpp"

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

}  // namespace breccia::gravity

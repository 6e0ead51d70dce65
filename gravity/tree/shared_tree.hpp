// One tree over the particles of all ranks, of which each rank holds the top and what lies below its own particles
// (gravity.md 5.4). Cells are defined by the keys of all particles, so the tree is the same on any number of ranks.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gravity/tree/tree.hpp"
#include "gravity/tree/walk.hpp"
#include "mpi/comm.hpp"

namespace breccia::gravity {

/// A leaf of the top: the cells below it lie on one rank.
struct TopLeaf {
  std::int32_t cell;
  std::int32_t owner;
  bool may_be_divided;  ///< a single group that may be sparse (opening.hpp)
  double reach;         ///< no group or larger target inside sticks out farther from its centre, |T - centre| + R_T
};

/// The top holds the largest cells, some ten thousand, and those that hold particles of several ranks down to single
/// groups; its leaves belong to one rank each. A group that lies on several ranks goes to the one that has
/// most of it: its particles travel there and their field comes back. Everything else stays where it is, so that memory
/// and messages grow with the surface between the ranks.
class SharedTree {
 public:
  /// Cells of more than one in so many particles belong to the top.
  static constexpr std::int64_t kTopLeaves = 8192;

  /// `top_leaves`: in place of kTopLeaves; at least kCoarseCells, as scales are sampled from the coarse tree.
  SharedTree(const mpi::Comm& comm, int threads, std::int64_t top_leaves = kTopLeaves)
      : comm_(comm), threads_(threads), top_leaves_(top_leaves) {}

  /// Builds the tree. All cells know their moments; those below the leaves of other ranks are not there. Collective.
  void build(const Root& root, ParticlesView particles, double mass_unit);

  /// Weighs the cells by acceleration_scales(). `densest`: the largest density() of what pulls them. Collective.
  void set_scales(std::span<const Cell> others, double softening, double densest);
  /// The largest density() of a cell that holds more than some group. Collective.
  [[nodiscard]] double largest_density() const;

  [[nodiscard]] const Tree& tree() const { return tree_; }
  [[nodiscard]] Tree& tree() { return tree_; }
  [[nodiscard]] const std::vector<double>& scales() const { return scales_; }
  /// In the order of the curve; empty on a single rank.
  [[nodiscard]] std::span<const TopLeaf> leaves() const { return leaves_; }
  /// The first cells, the same on all ranks.
  [[nodiscard]] std::size_t top_size() const { return top_.size(); }
  [[nodiscard]] double bytes_sent() const { return bytes_sent_; }

  /// Calls write(index in the caller's arrays, k, sums) for each particle of this rank, k its place in the sums: those
  /// given, or those of another rank. Collective.
  template <class Write>
  void deliver(const FieldSums& sums, Write write);

 private:
  struct TopCell {
    std::uint64_t low, high;  // keys of all ranks
    std::int32_t owner;       // the rank that has most of it
    bool divided;             // several ranks have some of it
  };
  struct Traveller {
    Vec3d position;
    double mass;
    std::uint64_t key;
    std::int64_t index;  // on its rank
    std::int32_t leaf;   // number of the leaf it belongs to
    std::int32_t home;
  };
  class Census;

  // shared_top.cpp
  void grow_top();
  [[nodiscard]] Split split_of_top(std::size_t cell) const;
  void split_top(std::span<const std::size_t> frontier);
  void list_leaves();
  void enclose_top();
  // shared_groups.cpp
  void gather_groups();
  void sort_by_leaves(std::vector<std::vector<Traveller>>& arrived);
  [[nodiscard]] FieldSums bring_home(const FieldSums& sums, std::vector<std::int64_t>& index);
  // shared_tree.cpp
  void grow_below();
  void share_moments();
  [[nodiscard]] double reach_of(const Cell& leaf) const;

  mpi::Comm comm_;
  int threads_;
  std::int64_t top_leaves_;
  double bytes_sent_ = 0.0;
  Tree tree_;
  std::vector<TopCell> top_;
  std::vector<TopLeaf> leaves_;
  std::vector<std::int32_t> home_;  // rank of each particle; empty: all are from here
  std::vector<double> scales_;
};

template <class Write>
void SharedTree::deliver(const FieldSums& sums, Write write) {
  const std::vector<std::int64_t>& order = tree_.particles.order;
  const std::size_t n = order.size();
#pragma omp parallel for num_threads(threads_) schedule(static)
  for (std::size_t k = 0; k < n; ++k) {
    if (home_.empty() || home_[k] == comm_.rank()) write(static_cast<std::size_t>(order[k]), k, sums);
  }
  if (comm_.size() == 1) return;
  std::vector<std::int64_t> index;
  const FieldSums home = bring_home(sums, index);
  for (std::size_t k = 0; k < index.size(); ++k) write(static_cast<std::size_t>(index[k]), k, home);
}

}  // namespace breccia::gravity

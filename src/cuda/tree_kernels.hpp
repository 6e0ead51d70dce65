// The tree of gravity in device memory, and the kernels that build and walk it (device_tree.cpp, tree_gravity.cpp).
#pragma once

#include <cstdint>

#include "cuda/gravity_kernels.hpp"
#include "gravity/mesh/box.hpp"
#include "gravity/tree/cell.hpp"
#include "gravity/tree/morton.hpp"
#include "gravity/tree/splitting.hpp"

namespace breccia::cuda {

/// Follows the last cell of a walk.
inline constexpr std::int32_t kNoCell = -1;

/// What a cell is to a walk: above the groups, a group of targets, or a part of one, which is only a source.
enum class Role : std::uint32_t { kTrunk, kGroup, kPart };

/// Bodies in the order of their keys, lengths in Root::unit.
struct SortedBodies {
  double* position[3] = {nullptr, nullptr, nullptr};
  double* mass = nullptr;
  unsigned* order = nullptr;             ///< index among the bodies of all ranks
  const std::uint64_t* key = nullptr;    ///< Morton keys
  const unsigned* own_before = nullptr;  ///< [count + 1] how many of the bodies before each are of this rank
  unsigned count = 0;
};

/// Cells level after level; children follow each other.
struct TreeView {
  gravity::Cell* cells = nullptr;
  std::int32_t* next = nullptr;  ///< the cell that follows where this one is not opened: no walk needs a stack
  Role* role = nullptr;
  double* scale = nullptr;  ///< gravity::acceleration_scales()
  unsigned count = 0;
};
struct Level {
  unsigned first, count;
};

/// keys[i] and order[i] := i of the bodies.
void launch_tree_keys(const BodyArrays& bodies, const gravity::Root& root, std::uint64_t* keys, unsigned* order,
                      cudaStream_t stream);
/// Fills positions and masses in units of `mass_unit`, in the order of the keys, of which `sorted.order` tells the
/// place among `bodies`; then it tells the place among those of all ranks. is_own[i] := 1 for those of this rank, which
/// are [first, first + own) of them, is_own[count] := 0.
void launch_arrange_bodies(const BodyArrays& bodies, const gravity::Root& root, double mass_unit, unsigned first,
                           unsigned own, const SortedBodies& sorted, unsigned* is_own, cudaStream_t stream);
/// The root cell.
void launch_plant(const TreeView& tree, const SortedBodies& sorted, cudaStream_t stream);

/// How the cells of a level split.
struct Splitting {
  unsigned* children;    ///< [cells + 1]; their number, the last 0; children before a cell once scanned
  std::int32_t* bounds;  ///< [cells][9] particles of the children
  std::int32_t* bits;    ///< [cells] key bits that the particles of a child share
};
void launch_split(const TreeView& tree, const SortedBodies& sorted, Level level, const Splitting& s,
                  cudaStream_t stream);
/// Makes the children, from cell `first_child` on.
void launch_grow(const TreeView& tree, const SortedBodies& sorted, Level level, unsigned first_child,
                 const Splitting& s, cudaStream_t stream);
/// Masses, centres, second moments and radii of a level whose children have theirs.
void launch_moments(const TreeView& tree, const SortedBodies& sorted, Level level, cudaStream_t stream);
/// The heaviest cells of the coarse tree, of whose pull a group's field is at least (gravity/tree/scale_rules.hpp), in
/// any order. Without mass there is no such pull, and what is beyond the room of the list is left out.
struct HeavyCells {
  static constexpr unsigned kMost = 32;  ///< disjoint cells with a sixteenth of the mass, and roundings
  unsigned count;                        ///< from 0; may come to more than kMost
  std::int32_t cell[kMost];
};
void launch_list_heavy(const TreeView& tree, std::int64_t coarse_limit, HeavyCells* heavy, cudaStream_t stream);
/// The roots of the trees of other bodies, in device memory.
struct OtherRoots {
  static constexpr int kMost = static_cast<int>(gravity::kMostBoxes);
  const gravity::Cell* cell[kMost] = {nullptr, nullptr, nullptr, nullptr};
  int count = 0;
};
/// Scales of all groups that hold bodies of this rank; the largest double for other cells.
void launch_sample_scales(const TreeView& tree, const SortedBodies& sorted, const HeavyCells* heavy,
                          const OtherRoots& others, std::int64_t coarse_limit, double softening, cudaStream_t stream);
/// Scales of the trunk cells of a level from their children.
void launch_combine_scales(const TreeView& tree, Level level, cudaStream_t stream);

/// A target cell of one step down the tree with the cells that are still to be placed for it.
struct WalkTarget {
  std::int32_t cell;
  std::int32_t weighed;  ///< the cell whose scale counts: this one, or for a part the group that it is of
  unsigned begin, end;   ///< in WalkStep::candidates
  bool divides;          ///< above the groups, or a sparse group: what is left passes to the children
};
using FarField = gravity::LocalExpansion<double>;

/// What became of the candidates: each list holds the entries of pair p from first[p] on, in the order of the pairs.
struct WalkList {
  unsigned* first = nullptr;     ///< [pairs + 1]; counts before they are scanned
  std::int32_t* cell = nullptr;  ///< what the list holds
};
enum ListKind { kExpanded = 0, kWhole = 1, kLeaves = 2 };
inline constexpr int kLists = 3;

/// Interactions of all walks since the counters were cleared.
struct WalkCounts {
  unsigned long long pairs, cells, expansions;
};

/// One step of the walk: target cells of a depth, each with its candidates. A pair is a target and a candidate.
struct WalkStep {
  TreeView tree;     ///< of the targets
  TreeView sources;  ///< the same tree, or one of other bodies
  unsigned targets = 0;
  WalkTarget* target = nullptr;
  const unsigned* pair_first = nullptr;  ///< [targets + 1]
  const std::int32_t* candidates = nullptr;
  unsigned pairs = 0;
  double tolerance = 0;
  double softening = 0;
  WalkList lists[kLists];   ///< to expand around the target; seen whole by a group, or left for the children; leaves
  FarField* far = nullptr;  ///< [targets] what the cells above expanded, to which this step adds
  WalkCounts* counts = nullptr;
};
/// Finds out which targets divide: those above the groups, and sparse groups (gravity/tree/walk.cpp).
void launch_divide(const WalkStep& step, cudaStream_t stream);
/// Counts what each pair gives each list; the entries after the last pair are 0.
void launch_count_pairs(const WalkStep& step, cudaStream_t stream);
/// Fills the lists.
void launch_list_pairs(const WalkStep& step, cudaStream_t stream);
/// Adds the fields of the expanded cells to `far`.
template <class Real>
void launch_expand(const WalkStep& step, cudaStream_t stream);

/// The targets of the next step: children that hold bodies of this rank.
struct Descent {
  unsigned* target_first = nullptr;  ///< [targets + 1] children to visit; before each target, once scanned
  unsigned* pair_first = nullptr;    ///< [targets + 1] the same for their pairs
  WalkTarget* target = nullptr;
  unsigned* next_pair_first = nullptr;
  FarField* far = nullptr;
};
void launch_count_descent(const WalkStep& step, const Descent& d, cudaStream_t stream);
void launch_descend(const WalkStep& step, const Descent& d, cudaStream_t stream);

/// leaf_first[l] := particles of the listed leaf l, 0 after the last.
void launch_leaf_sizes(const WalkStep& step, unsigned leaves, unsigned* leaf_first, cudaStream_t stream);

/// Fields of the groups among the targets, added to what is there.
struct GroupSums {
  SortedBodies bodies;  ///< of the targets
  SortedBodies sources;
  const unsigned* leaf_first = nullptr;  ///< scanned
  unsigned first = 0, own = 0;           ///< this rank's among the bodies of all ranks
  double unit = 1;                       ///< of the accelerations [m/s2]
  double* acceleration = nullptr;        ///< [3][own]
};
template <class Real>
void launch_sum_groups(const WalkStep& step, const GroupSums& sums, cudaStream_t stream);

}  // namespace breccia::cuda

// Which cells and particles act on which targets: the walk of gravity/tree/walk.cpp, all targets of a depth at once. A
// thread takes one candidate of one target; what it finds is counted, scanned and listed.
#include "cuda/check.hpp"
#include "cuda/launchers.hpp"
#include "cuda/search.cuh"
#include "cuda/tree_kernels.hpp"
#include "gravity/tree/opening.hpp"

namespace breccia::cuda {
namespace {

using gravity::Cell;
using gravity::Opening;

constexpr unsigned kThreads = 128;
constexpr unsigned kWarp = 32;
constexpr unsigned kAllLanes = 0xffffffffU;

__device__ __forceinline__ unsigned thread_number() { return blockIdx.x * kThreads + threadIdx.x; }

enum class Fate { kOpen, kListed, kSkipped };
struct Decision {
  Fate fate;
  ListKind list;
};

// Above the groups: expanded, or kept for the children once it is no larger than the target.
__device__ __forceinline__ Decision for_trunk(const Cell& source, const Cell& target, double allowed) {
  if (gravity::expandable(source, target, allowed)) return {Fate::kListed, kExpanded};
  const bool open = !source.is_leaf() && source.radius >= target.radius;
  return {open ? Fate::kOpen : Fate::kListed, kWhole};
}

// Groups take what is left in one way or the other. Their own particles come first of all.
__device__ __forceinline__ Decision for_group(const Cell& source, const Cell& group, double allowed, bool same_tree) {
  if (same_tree && source.begin >= group.begin && source.end <= group.end) return {Fate::kSkipped, kWhole};
  const Opening how = source.count > gravity::kFewParticles ? gravity::opening(source, group, allowed) : Opening::kOpen;
  if (how == Opening::kExpand) return {Fate::kListed, kExpanded};
  if (how == Opening::kWhole) return {Fate::kListed, kWhole};
  return {source.is_leaf() ? Fate::kListed : Fate::kOpen, kLeaves};
}

// Places the candidate of pair p and its parts: take(list, cell) for each entry.
template <class Take>
__device__ __forceinline__ void place_pair(const WalkStep& w, unsigned p, Take& take) {
  const unsigned t = place_of(p, w.pair_first, w.targets);
  const WalkTarget& target = w.target[t];
  const Cell& cell = w.tree.cells[target.cell];
  const double allowed = w.tolerance * w.tree.scale[target.weighed];
  const bool same_tree = w.sources.cells == w.tree.cells;
  const std::int32_t candidate = w.candidates[target.begin + (p - w.pair_first[t])];
  const std::int32_t end = w.sources.next[candidate];
  for (std::int32_t s = candidate; s != end;) {
    const Cell& source = w.sources.cells[s];
    const Decision d = target.divides ? for_trunk(source, cell, allowed) : for_group(source, cell, allowed, same_tree);
    if (d.fate == Fate::kListed) take(d.list, s);
    s = d.fate == Fate::kOpen ? source.first_child : w.sources.next[s];
  }
}

// A warp for each target.
__global__ void __launch_bounds__(kThreads) divide(WalkStep w) {
  const unsigned t = thread_number() / kWarp;
  if (t >= w.targets) return;
  WalkTarget& target = w.target[t];
  const Cell& cell = w.tree.cells[target.cell];
  const bool trunk = w.tree.role[target.cell] == Role::kTrunk;
  bool outweighed = false;
  for (unsigned k = target.begin + threadIdx.x % kWarp; k < target.end && !trunk; k += kWarp) {
    outweighed = outweighed || gravity::outweighs(w.sources.cells[w.candidates[k]], cell);
  }
  const bool sparse = __ballot_sync(kAllLanes, outweighed ? 1 : 0) != 0 && !cell.is_smallest_group();
  if (threadIdx.x % kWarp == 0) target.divides = trunk || sparse;
}

struct Counting {
  unsigned count[kLists] = {0, 0, 0};
  __device__ __forceinline__ void operator()(ListKind list, std::int32_t) { ++count[list]; }
};
__global__ void __launch_bounds__(kThreads) count_pairs(WalkStep w) {
  const unsigned p = thread_number();
  if (p > w.pairs) return;
  Counting counting;
  if (p < w.pairs) place_pair(w, p, counting);
  for (int list = 0; list < kLists; ++list) w.lists[list].first[p] = counting.count[list];
}

// No array of pointers: it would lie in local memory.
struct Listing {
  std::int32_t *expanded, *whole, *leaves;
  __device__ __forceinline__ void operator()(ListKind list, std::int32_t cell) {
    if (list == kExpanded) {
      *expanded++ = cell;
    } else if (list == kWhole) {
      *whole++ = cell;
    } else {
      *leaves++ = cell;
    }
  }
};
// Of a multiprocessor's registers, half: with fewer it would spill.
__global__ void __launch_bounds__(kThreads, 8) list_pairs(WalkStep w) {
  const unsigned p = thread_number();
  if (p >= w.pairs) return;
  const auto place = [&](ListKind list) { return w.lists[list].cell + w.lists[list].first[p]; };
  Listing listing{place(kExpanded), place(kWhole), place(kLeaves)};
  place_pair(w, p, listing);
}

// Entries of a list that the pairs of a target gave.
__device__ __forceinline__ unsigned list_begin(const WalkStep& w, ListKind list, unsigned target) {
  return w.lists[list].first[w.pair_first[target]];
}

__global__ void __launch_bounds__(kThreads) count_descent(WalkStep w, Descent d) {
  const unsigned t = thread_number();
  if (t > w.targets) return;
  unsigned children = 0;
  unsigned pairs = 0;
  if (t < w.targets && w.target[t].divides) {
    const Cell& cell = w.tree.cells[w.target[t].cell];
    for (std::int32_t c = 0; c < cell.children; ++c) children += w.tree.cells[cell.first_child + c].is_target ? 1U : 0U;
    pairs = children * (list_begin(w, kWhole, t + 1) - list_begin(w, kWhole, t));
  }
  d.target_first[t] = children;
  d.pair_first[t] = pairs;
}

// The candidates of all children of a target are what its own step left.
__global__ void __launch_bounds__(kThreads) descend(WalkStep w, Descent d) {
  const unsigned t = thread_number();
  if (t == 0) d.next_pair_first[d.target_first[w.targets]] = d.pair_first[w.targets];
  if (t >= w.targets || d.target_first[t] == d.target_first[t + 1]) return;
  const WalkTarget& target = w.target[t];
  const Cell& cell = w.tree.cells[target.cell];
  const bool above_groups = w.tree.role[target.cell] == Role::kTrunk;
  const unsigned begin = list_begin(w, kWhole, t);
  const unsigned end = list_begin(w, kWhole, t + 1);
  unsigned to = d.target_first[t];
  unsigned pair = d.pair_first[t];
  for (std::int32_t c = cell.first_child; c < cell.first_child + cell.children; ++c) {
    const Cell& child = w.tree.cells[c];
    if (!child.is_target) continue;
    d.target[to] = {c, above_groups ? c : target.weighed, begin, end, false};
    d.next_pair_first[to] = pair;
    d.far[to] = gravity::shifted(w.far[t], child.centre - cell.centre);
    pair += end - begin;
    ++to;
  }
}

__global__ void __launch_bounds__(kThreads) leaf_sizes(WalkStep w, unsigned leaves, unsigned* leaf_first) {
  const unsigned l = thread_number();
  if (l > leaves) return;
  leaf_first[l] = l < leaves ? static_cast<unsigned>(w.sources.cells[w.lists[kLeaves].cell[l]].count) : 0U;
}

dim3 threads_for(unsigned items) { return {blocks_for(items, kThreads)}; }
void launched() { check(cudaGetLastError(), "launch of a kernel of the tree's walk"); }

}  // namespace

void launch_divide(const WalkStep& step, cudaStream_t stream) {
  BRECCIA_LAUNCH(divide, dim3(blocks_for(step.targets, kThreads / kWarp)), dim3(kThreads), 0, stream, step);
  launched();
}

void launch_count_pairs(const WalkStep& step, cudaStream_t stream) {
  BRECCIA_LAUNCH(count_pairs, threads_for(step.pairs + 1), dim3(kThreads), 0, stream, step);
  launched();
}

void launch_list_pairs(const WalkStep& step, cudaStream_t stream) {
  if (step.pairs == 0) return;
  BRECCIA_LAUNCH(list_pairs, threads_for(step.pairs), dim3(kThreads), 0, stream, step);
  launched();
}

void launch_count_descent(const WalkStep& step, const Descent& d, cudaStream_t stream) {
  BRECCIA_LAUNCH(count_descent, threads_for(step.targets + 1), dim3(kThreads), 0, stream, step, d);
  launched();
}

void launch_descend(const WalkStep& step, const Descent& d, cudaStream_t stream) {
  BRECCIA_LAUNCH(descend, threads_for(step.targets), dim3(kThreads), 0, stream, step, d);
  launched();
}

void launch_leaf_sizes(const WalkStep& step, unsigned leaves, unsigned* leaf_first, cudaStream_t stream) {
  BRECCIA_LAUNCH(leaf_sizes, threads_for(leaves + 1), dim3(kThreads), 0, stream, step, leaves, leaf_first);
  launched();
}

}  // namespace breccia::cuda

// The tree over sorted keys, level by level, with moments and scales, by the functions that the host's tree uses.
#include <cfloat>
#include <cmath>

#include "cuda/check.hpp"
#include "cuda/launchers.hpp"
#include "cuda/tree_kernels.hpp"
#include "cuda/tree_tiles.cuh"
#include "gravity/tree/cell_moments.hpp"
#include "gravity/tree/scale_rules.hpp"

namespace breccia::cuda {
namespace {

using gravity::Cell;

constexpr unsigned kThreads = 128;
constexpr unsigned kWarp = 32;
constexpr unsigned kAllLanes = 0xffffffffU;

__device__ __forceinline__ unsigned thread_number() { return blockIdx.x * kThreads + threadIdx.x; }

struct PositionOf {
  const SortedBodies& bodies;
  __device__ __forceinline__ Vec3d operator()(std::int64_t i) const {
    return {bodies.position[0][i], bodies.position[1][i], bodies.position[2][i]};
  }
};
struct MassOf {
  const SortedBodies& bodies;
  __device__ __forceinline__ double operator()(std::int64_t i) const { return bodies.mass[i]; }
};

// --- bodies ---------------------------------------------------------------------------------------------------------

__global__ void __launch_bounds__(kThreads)
    tree_keys(BodyArrays bodies, gravity::Root root, double cells_per_unit, std::uint64_t* keys, unsigned* order) {
  const unsigned i = thread_number();
  if (i >= bodies.count) return;
  keys[i] = gravity::morton_key(root.scaled(bodies.at(i)), cells_per_unit);
  order[i] = i;
}

__global__ void __launch_bounds__(kThreads)
    arrange_bodies(BodyArrays bodies, gravity::Root root, double mass_unit, unsigned first, unsigned own,
                   SortedBodies sorted, unsigned* is_own) {
  const unsigned i = thread_number();
  if (i == 0) is_own[bodies.count] = 0;
  if (i >= bodies.count) return;
  const unsigned from = sorted.order[i];
  const Vec3d x = root.scaled(bodies.at(from));
  sorted.position[0][i] = x.x;
  sorted.position[1][i] = x.y;
  sorted.position[2][i] = x.z;
  sorted.mass[i] = bodies.mass[from] / mass_unit;
  sorted.order[i] = bodies.place(from);
  is_own[i] = sorted.order[i] - first < own ? 1U : 0U;
}

// --- cells ----------------------------------------------------------------------------------------------------------

__device__ __forceinline__ Cell cell_of(const SortedBodies& sorted, std::int32_t begin, std::int32_t end,
                                        int key_bits) {
  Cell cell;
  cell.begin = begin;
  cell.end = end;
  cell.count = end - begin;
  cell.key_bits = key_bits;
  cell.is_target = sorted.own_before[end] > sorted.own_before[begin];
  return cell;
}

__global__ void plant(TreeView tree, SortedBodies sorted) {
  tree.cells[0] = cell_of(sorted, 0, static_cast<std::int32_t>(sorted.count), 0);
  tree.next[0] = kNoCell;
  tree.role[0] = Role::kTrunk;
}

// First particle of [begin, end) whose key has another prefix than the one at `begin`.
__device__ __forceinline__ std::int32_t end_of_prefix(const std::uint64_t* key, std::int32_t begin, std::int32_t end,
                                                      int bits) {
  const std::uint64_t here = gravity::prefix(key[begin], bits);
  std::int32_t low = begin + 1;
  while (low < end) {
    const std::int32_t middle = low + (end - low) / 2;
    if (gravity::prefix(key[middle], bits) == here) {
      low = middle + 1;
    } else {
      end = middle;
    }
  }
  return low;
}

__global__ void __launch_bounds__(kThreads) split_cells(TreeView tree, SortedBodies sorted, Level level, Splitting s) {
  const unsigned k = thread_number();
  if (k == 0) s.children[level.count] = 0;
  if (k >= level.count) return;
  const Cell& cell = tree.cells[level.first + k];
  const gravity::Split split =
      gravity::split_of(cell.count, cell.key_bits, sorted.key[cell.begin], sorted.key[cell.end - 1]);
  std::int32_t* bounds = s.bounds + std::size_t{k} * (gravity::kMostChildren + 1);
  unsigned children = 0;
  bounds[0] = cell.begin;
  if (split.bits > 0) {
    for (std::int32_t at = cell.begin; at < cell.end;) {
      at = end_of_prefix(sorted.key, at, cell.end, split.start + split.bits);
      bounds[++children] = at;
    }
  }
  s.children[k] = children;
  s.bits[k] = split.start + split.bits;
  Role& role = tree.role[level.first + k];
  if (role == Role::kTrunk && (cell.count <= gravity::kGroupParticles || children == 0)) role = Role::kGroup;
}

__global__ void __launch_bounds__(kThreads)
    grow_cells(TreeView tree, SortedBodies sorted, Level level, unsigned first_child, Splitting s) {
  const unsigned k = thread_number();
  if (k >= level.count) return;
  const unsigned parent = level.first + k;
  const unsigned children = s.children[k + 1] - s.children[k];
  const unsigned first = first_child + s.children[k];
  tree.cells[parent].first_child = static_cast<std::int32_t>(first);
  tree.cells[parent].children = static_cast<std::int32_t>(children);
  const std::int32_t* bounds = s.bounds + std::size_t{k} * (gravity::kMostChildren + 1);
  for (unsigned c = 0; c < children; ++c) {
    tree.cells[first + c] = cell_of(sorted, bounds[c], bounds[c + 1], s.bits[k]);
    tree.next[first + c] = c + 1 < children ? static_cast<std::int32_t>(first + c + 1) : tree.next[parent];
    tree.role[first + c] = tree.role[parent] == Role::kTrunk ? Role::kTrunk : Role::kPart;
  }
}

// A warp for each cell: its lanes share the search for the farthest particle, the largest distance of any order.
__global__ void __launch_bounds__(kThreads) set_moments(TreeView tree, SortedBodies sorted, Level level) {
  const unsigned k = thread_number() / kWarp;
  if (k >= level.count) return;
  const unsigned lane = threadIdx.x % kWarp;
  Cell& cell = tree.cells[level.first + k];
  if (lane == 0) {
    if (cell.is_leaf()) {
      gravity::set_leaf_moments(cell, PositionOf{sorted}, MassOf{sorted});
    } else {
      gravity::combine_children(cell, tree.cells + cell.first_child);
    }
  }
  __syncwarp();
  if (!cell.is_leaf() && cell.count > gravity::kExactRadius) return;
  const Vec3d centre = cell.centre;
  double farthest = 0.0;
  for (std::int32_t i = cell.begin + static_cast<std::int32_t>(lane); i < cell.end;
       i += static_cast<std::int32_t>(kWarp)) {
    const Vec3d d = PositionOf{sorted}(i)-centre;
    farthest = std::fmax(farthest, dot(d, d));
  }
  for (unsigned step = kWarp / 2; step > 0; step /= 2) {
    farthest = std::fmax(farthest, __shfl_down_sync(kAllLanes, farthest, step));
  }
  if (lane == 0) cell.radius = gravity::enclosing_radius(farthest);
}

// --- scales
// -----------------------------------------------------------------------------------------------------------

// As gravity/tree/scales.cpp: what sample particles feel from the coarse tree without the cell they are in.
constexpr unsigned kSamples = gravity::kScaleSamples;

__device__ __forceinline__ bool is_heavy(const Cell& cell, double least, std::int64_t coarse) {
  return cell.moments.mass >= least && cell.count > coarse;
}

__global__ void __launch_bounds__(kThreads) list_heavy(TreeView tree, std::int64_t coarse, HeavyCells* heavy) {
  const unsigned c = thread_number();
  if (c >= tree.count) return;
  const double least = gravity::kHeavy * tree.cells[0].moments.mass;
  const Cell& cell = tree.cells[c];
  if (c > 0 && !is_heavy(cell, least, coarse)) return;
  for (std::int32_t k = cell.first_child; k < cell.first_child + cell.children; ++k) {
    if (is_heavy(tree.cells[k], least, coarse)) return;
  }
  const unsigned place = atomicAdd(&heavy->count, 1U);
  if (place < HeavyCells::kMost) heavy->cell[place] = static_cast<std::int32_t>(c);
}

__device__ __forceinline__ Vec3d sampled_field(const TreeView& tree, const Cell& group, Vec3<float> x,
                                               float softening_squared, std::int64_t coarse, double faint) {
  Vec3d sum{};
  for (std::int32_t c = 0; c != kNoCell;) {
    const Cell& cell = tree.cells[c];
    const bool own = gravity::contains(cell, group);
    if (cell.count > coarse && !cell.is_leaf() && (own || gravity::opened_for_scale(cell, group, faint))) {
      c = cell.first_child;
      continue;
    }
    if (!own) {
      DistantCell<float> source;
      source.set(cell, group.centre);
      const Vec3<float> r = x - source.position;
      sum += to_double(gravity::field_of(source.moments, r, inverse_root(dot(r, r) + softening_squared)).gradient);
    }
    c = tree.next[c];
  }
  return sum;
}

__global__ void __launch_bounds__(kThreads)
    sample_scales(TreeView tree, SortedBodies sorted, const HeavyCells* heavy, OtherRoots others,
                  float softening_squared, std::int64_t coarse) {
  const unsigned c = thread_number() / kWarp;
  if (c >= tree.count) return;
  const Cell& group = tree.cells[c];
  const unsigned lane = threadIdx.x % kWarp;
  double least = DBL_MAX;
  if (tree.role[c] == Role::kGroup && group.is_target) {
    const std::int64_t sample = lane % kSamples;
    const Vec3d x = PositionOf{sorted}(group.begin + sample * (group.end - group.begin) / kSamples);
    double field = 0.0;
    for (unsigned n = 0; n < heavy->count && n < HeavyCells::kMost; ++n) {
      field = std::fmax(field, gravity::least_pull(tree.cells[heavy->cell[n]], group));
    }
    const Vec3d a = sampled_field(tree, group, to_real<float>(x - group.centre), softening_squared, coarse,
                                  gravity::kFaint * field);
    least = std::sqrt(dot(a, a));
    for (unsigned step = kWarp / 2; step > 0; step /= 2) {
      least = std::fmin(least, __shfl_down_sync(kAllLanes, least, step));
    }
    // Of known length, so that the pointers stay where parameters lie.
    for (int k = 0; k < OtherRoots::kMost; ++k) {
      if (k < others.count) least = std::fmax(least, gravity::pull_of_whole(*others.cell[k], group));
    }
  }
  if (lane == 0) tree.scale[c] = least;
}

__global__ void __launch_bounds__(kThreads) combine_scales(TreeView tree, Level level) {
  const unsigned k = thread_number();
  if (k >= level.count || tree.role[level.first + k] != Role::kTrunk) return;
  const Cell& cell = tree.cells[level.first + k];
  double least = DBL_MAX;
  for (std::int32_t c = cell.first_child; c < cell.first_child + cell.children; ++c) {
    least = std::fmin(least, tree.scale[c]);
  }
  tree.scale[level.first + k] = least;
}

dim3 threads_for(unsigned items) { return {blocks_for(items, kThreads)}; }
dim3 warps_for(unsigned items) { return {blocks_for(items, kThreads / kWarp)}; }
void launched() { check(cudaGetLastError(), "launch of a kernel of the tree"); }

}  // namespace

void launch_tree_keys(const BodyArrays& bodies, const gravity::Root& root, std::uint64_t* keys, unsigned* order,
                      cudaStream_t stream) {
  const double cells_per_unit = std::exp2(gravity::kKeyBitsPerAxis) * root.unit / root.side;
  BRECCIA_LAUNCH(tree_keys, threads_for(bodies.count), dim3(kThreads), 0, stream, bodies, root, cells_per_unit, keys,
                 order);
  launched();
}

void launch_arrange_bodies(const BodyArrays& bodies, const gravity::Root& root, double mass_unit, unsigned first,
                           unsigned own, const SortedBodies& sorted, unsigned* is_own, cudaStream_t stream) {
  BRECCIA_LAUNCH(arrange_bodies, threads_for(bodies.count), dim3(kThreads), 0, stream, bodies, root, mass_unit, first,
                 own, sorted, is_own);
  launched();
}

void launch_plant(const TreeView& tree, const SortedBodies& sorted, cudaStream_t stream) {
  BRECCIA_LAUNCH(plant, dim3(1), dim3(1), 0, stream, tree, sorted);
  launched();
}

void launch_split(const TreeView& tree, const SortedBodies& sorted, Level level, const Splitting& s,
                  cudaStream_t stream) {
  BRECCIA_LAUNCH(split_cells, threads_for(level.count), dim3(kThreads), 0, stream, tree, sorted, level, s);
  launched();
}

void launch_grow(const TreeView& tree, const SortedBodies& sorted, Level level, unsigned first_child,
                 const Splitting& s, cudaStream_t stream) {
  BRECCIA_LAUNCH(grow_cells, threads_for(level.count), dim3(kThreads), 0, stream, tree, sorted, level, first_child, s);
  launched();
}

void launch_moments(const TreeView& tree, const SortedBodies& sorted, Level level, cudaStream_t stream) {
  BRECCIA_LAUNCH(set_moments, warps_for(level.count), dim3(kThreads), 0, stream, tree, sorted, level);
  launched();
}

void launch_list_heavy(const TreeView& tree, std::int64_t coarse_limit, HeavyCells* heavy, cudaStream_t stream) {
  BRECCIA_LAUNCH(list_heavy, threads_for(tree.count), dim3(kThreads), 0, stream, tree, coarse_limit, heavy);
  launched();
}

void launch_sample_scales(const TreeView& tree, const SortedBodies& sorted, const HeavyCells* heavy,
                          const OtherRoots& others, std::int64_t coarse_limit, double softening, cudaStream_t stream) {
  BRECCIA_LAUNCH(sample_scales, warps_for(tree.count), dim3(kThreads), 0, stream, tree, sorted, heavy, others,
                 static_cast<float>(softening * softening), coarse_limit);
  launched();
}

void launch_combine_scales(const TreeView& tree, Level level, cudaStream_t stream) {
  BRECCIA_LAUNCH(combine_scales, threads_for(level.count), dim3(kThreads), 0, stream, tree, level);
  launched();
}

}  // namespace breccia::cuda

// Fields of distant cells and near particles, by the interactions of gravity/tree/multipole.hpp and pair_law.hpp.
#include "cuda/check.hpp"
#include "cuda/launchers.hpp"
#include "cuda/tree_kernels.hpp"
#include "cuda/tree_tiles.cuh"

namespace breccia::cuda {
namespace {

using gravity::Cell;

constexpr unsigned kThreads = kTileSources;
constexpr unsigned kWarp = 32;
constexpr unsigned kAllLanes = 0xffffffffU;

// --- expansions
// -------------------------------------------------------------------------------------------------------

// Adds the sum over the lanes of a warp, in an order of its own, on the first lane.
struct AddOverWarp {
  template <class Real>
  __device__ __forceinline__ void operator()(double& to, const Real& own) const {
    auto sum = static_cast<double>(own);
    for (unsigned step = kWarp / 2; step > 0; step /= 2) sum += __shfl_down_sync(kAllLanes, sum, step);
    if (threadIdx.x % kWarp == 0) to += sum;
  }
};

// A warp for each target, a lane for each cell at a time.
template <class Real>
__global__ void __launch_bounds__(kThreads) expand_cells(WalkStep w) {
  const unsigned t = (blockIdx.x * kThreads + threadIdx.x) / kWarp;
  if (t >= w.targets) return;
  const WalkList& list = w.lists[kExpanded];
  const unsigned begin = list.first[w.pair_first[t]];
  const unsigned end = list.first[w.pair_first[t + 1]];
  if (begin == end) return;
  const Vec3d centre = w.tree.cells[w.target[t].cell].centre;
  const auto softening_squared = squared_softening<Real>(w.softening);
  gravity::LocalExpansion<Real> sum{};
  for (unsigned k = begin + threadIdx.x % kWarp; k < end; k += kWarp) {
    DistantCell<Real> source;
    source.set(w.sources.cells[list.cell[k]], centre);
    const Vec3<Real> x = -source.position;
    gravity::add_field_of(source.moments, x, inverse_root(dot(x, x) + softening_squared), sum);
  }
  gravity::for_each_coefficient(w.far[t], sum, AddOverWarp{});
  if (threadIdx.x % kWarp == 0) atomicAdd(&w.counts->expansions, static_cast<unsigned long long>(end - begin));
}

// --- groups
// -----------------------------------------------------------------------------------------------------------

__device__ __forceinline__ Vec3d position_of(const SortedBodies& bodies, unsigned i) {
  return {bodies.position[0][i], bodies.position[1][i], bodies.position[2][i]};
}

// One group and the lists of what acts on it.
struct Group {
  Vec3d centre;
  unsigned begin, end;                // particles
  unsigned own_sources;               // of them that act on each other: all, or none
  unsigned first_cell, last_cell;     // of the list of whole cells
  unsigned first_leaf, last_leaf;     // of the list of leaves
  unsigned first_source, end_source;  // of all particles of all listed leaves
};

// All threads of the block call this; those without a target take part for the tiles.
template <class Real>
__device__ __forceinline__ Vec3d field_of_cells(const WalkStep& w, const Group& g, CellTile<Real>& tile, Vec3<Real> x,
                                                Real softening_squared) {
  Vec3d total{};
  for (unsigned from = g.first_cell; from < g.last_cell; from += kTileCells) {
    const unsigned count = g.last_cell - from < kTileCells ? g.last_cell - from : kTileCells;
    if (threadIdx.x < count) {
      tile.cell[threadIdx.x].set(w.sources.cells[w.lists[kWhole].cell[from + threadIdx.x]], g.centre);
    }
    __syncthreads();
    Vec3<Real> sum{};
    for (unsigned k = 0; k < count; ++k) {
      const Vec3<Real> r = x - tile.cell[k].position;
      sum += gravity::field_of(tile.cell[k].moments, r, inverse_root(dot(r, r) + softening_squared)).gradient;
    }
    total += to_double(sum);
    __syncthreads();
  }
  return total;
}

// Particle number k among those of the group's leaves.
__device__ __forceinline__ unsigned leaf_particle(const WalkStep& w, const GroupSums& s, const Group& g, unsigned k) {
  unsigned low = g.first_leaf;
  unsigned high = g.last_leaf;
  while (high - low > 1) {
    const unsigned middle = low + (high - low) / 2;
    (s.leaf_first[middle] <= k ? low : high) = middle;
  }
  return static_cast<unsigned>(w.sources.cells[w.lists[kLeaves].cell[low]].begin) + (k - s.leaf_first[low]);
}

// The same for particles: first the group's own where they are sources, then those of the leaves.
template <class Real>
__device__ __forceinline__ Vec3d field_of_particles(const WalkStep& w, const GroupSums& s, const Group& g,
                                                    PairTile<Real>& tile, Vec3<Real> target, Real softening_squared) {
  const unsigned own = g.own_sources;
  const unsigned all = own + (g.end_source - g.first_source);
  Vec3d total{};
  for (unsigned from = 0; from < all; from += kTileSources) {
    const unsigned count = all - from < kTileSources ? all - from : kTileSources;
    if (threadIdx.x < count) {
      const unsigned k = from + threadIdx.x;
      const unsigned j = k < own ? g.begin + k : leaf_particle(w, s, g, g.first_source + (k - own));
      tile.source[threadIdx.x] = {to_real<Real>(position_of(s.sources, j) - g.centre),
                                  static_cast<Real>(s.sources.mass[j])};
    }
    __syncthreads();
    total += sum_of_tile(tile, count, target, softening_squared);
    __syncthreads();
  }
  return total;
}

template <class Real>
__device__ __forceinline__ Vec3d far_field(const FarField& far, Vec3<Real> x) {
  gravity::LocalExpansion<Real> l;
  gravity::for_each_coefficient(l, far, [](Real& to, double from) { to = static_cast<Real>(from); });
  return to_double(gravity::evaluate(l, x).gradient);
}

__device__ __forceinline__ Group group_of(const WalkStep& w, const GroupSums& s, unsigned t) {
  const Cell& cell = w.tree.cells[w.target[t].cell];
  const unsigned first_pair = w.pair_first[t];
  const unsigned last_pair = w.pair_first[t + 1];
  Group g{};
  g.centre = cell.centre;
  g.begin = static_cast<unsigned>(cell.begin);
  g.end = static_cast<unsigned>(cell.end);
  g.own_sources = w.sources.cells == w.tree.cells ? g.end - g.begin : 0U;
  g.first_cell = w.lists[kWhole].first[first_pair];
  g.last_cell = w.lists[kWhole].first[last_pair];
  g.first_leaf = w.lists[kLeaves].first[first_pair];
  g.last_leaf = w.lists[kLeaves].first[last_pair];
  g.first_source = s.leaf_first[g.first_leaf];
  g.end_source = s.leaf_first[g.last_leaf];
  return g;
}

__device__ __forceinline__ void count_interactions(const Group& g, WalkCounts& counts) {
  const unsigned long long targets = g.end - g.begin;
  atomicAdd(&counts.pairs, targets * (g.own_sources + (g.end_source - g.first_source)));
  atomicAdd(&counts.cells, targets * (g.last_cell - g.first_cell));
}

// A block of threads for each target that is a group, a thread for each of its particles.
template <class Real>
__global__ void __launch_bounds__(kThreads) sum_groups(WalkStep w, GroupSums s) {
  BRECCIA_SHARED(GroupShared<Real>, shared);
  const unsigned t = blockIdx.x;
  if (w.target[t].divides) return;
  const Group g = group_of(w, s, t);
  const auto softening_squared = squared_softening<Real>(w.softening);
  // More than a block's threads only where many particles lie on one point.
  for (unsigned first = g.begin; first < g.end; first += kThreads) {
    const unsigned i = first + threadIdx.x < g.end ? first + threadIdx.x : g.begin;
    const Vec3<Real> x = to_real<Real>(position_of(s.bodies, i) - g.centre);
    Vec3d sum = far_field(w.far[t], x);
    sum += field_of_cells(w, g, shared.cells, x, softening_squared);
    sum += field_of_particles(w, s, g, shared.pairs, x, softening_squared);
    const unsigned to = s.bodies.order[i] - s.first;
    if (first + threadIdx.x >= g.end || to >= s.own) continue;
    s.acceleration[to] += s.unit * sum.x;
    s.acceleration[s.own + to] += s.unit * sum.y;
    s.acceleration[2 * std::size_t{s.own} + to] += s.unit * sum.z;
  }
  if (threadIdx.x == 0) count_interactions(g, *w.counts);
}

void launched() { check(cudaGetLastError(), "launch of a sum of the tree"); }

}  // namespace

template <class Real>
void launch_expand(const WalkStep& step, cudaStream_t stream) {
  BRECCIA_LAUNCH(expand_cells<Real>, dim3(blocks_for(step.targets, kThreads / kWarp)), dim3(kThreads), 0, stream, step);
  launched();
}

template <class Real>
void launch_sum_groups(const WalkStep& step, const GroupSums& sums, cudaStream_t stream) {
  BRECCIA_LAUNCH(sum_groups<Real>, dim3(step.targets), dim3(kThreads), sizeof(GroupShared<Real>), stream, step, sums);
  launched();
}

template void launch_expand<float>(const WalkStep&, cudaStream_t);
template void launch_expand<double>(const WalkStep&, cudaStream_t);
template void launch_sum_groups<float>(const WalkStep&, const GroupSums&, cudaStream_t);
template void launch_sum_groups<double>(const WalkStep&, const GroupSums&, cudaStream_t);

}  // namespace breccia::cuda

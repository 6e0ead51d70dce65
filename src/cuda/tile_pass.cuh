// The pass over one tile by one thread block: velocities of its nodes to shared memory, G2P, update and stress one
// thread a particle, then P2G one warp a set of channels, one lane a node of the stencil. Particles are added one after
// the other and every channel by one warp, so there is nothing to be made atomic, and sums do not depend on the order
// in which warps run: a run repeats bit for bit.
#pragma once

#include "cuda/check.hpp"
#include "cuda/device_runtime.hpp"
#include "cuda/launchers.hpp"
#include "cuda/node_order.hpp"
#include "cuda/particle_update.hpp"
#include "cuda/work_sums.cuh"

namespace breccia::cuda {

inline constexpr int kStencil = 3;
inline constexpr int kStencilNodes = 27;
/// Velocities in shared memory: threads read nodes of their own, mostly those of neighbours.
inline constexpr int kReadNodes = kTileNodes;
BRECCIA_HD int read_node(int x, int y, int z) { return (x * grid::kTileWidth + y) * grid::kTileWidth + z; }
/// Sums in shared memory: lanes add to the 27 nodes of one stencil, which lie in as many of the 32 banks.
inline constexpr int kSumRow = grid::kTileWidth + 1;
inline constexpr int kSumPlane = 99;
inline constexpr int kSumNodes = grid::kTileWidth * kSumPlane;
static_assert(kSumPlane >= grid::kTileWidth * kSumRow && kSumPlane % 32 == 3 && kSumRow % 32 == 9);
BRECCIA_HD int sum_node(int x, int y, int z) { return x * kSumPlane + y * kSumRow + z; }

/// What a particle gives to its 27 nodes: node (r) gets w (value + slope . r), r in cells from the nearest node. All
/// members are read at once by all lanes, 16 bytes at a time.
template <class Real>
struct Spread {
  struct alignas(16) Linear {
    Real value, x, y, z;
  };
  struct alignas(16) Place {
    Real offset[3];  ///< from the nearest node [cells]
    int start;       ///< first node; negative: nothing to give
  };
  Linear channel[3][2];  ///< [axis] momentum, force
  Place place;
};

template <class Real>
struct TileShared {
  Spread<Real> spread[kPassThreads];
  Real mass[kPassThreads];
  Real velocities[kVelocities][kReadNodes];
  Real sums[kSums][kSumNodes];
  ThreadWork work[kPassThreads];
  unsigned touched;  ///< 8 bits an axis: first nodes of the stencils
};

/// Quadratic B-spline weights about the nearest node, offset in [-1/2, 1/2) cells.
template <class Real>
struct Stencil {
  Real offset[3];
  Real weight[3][kStencil];
  int start[3];

  BRECCIA_HD explicit Stencil(const Motion<Real>& m) {
    for (int axis = 0; axis < 3; ++axis) {
      start[axis] = stencil_start(m.node, axis);
      const Real d = offset_in_cells(m.offset[axis]);
      const Real lower = Real(0.5) - d;
      const Real upper = Real(0.5) + d;
      offset[axis] = d;
      weight[axis][0] = Real(0.5) * lower * lower;
      weight[axis][1] = Real(0.75) - d * d;
      weight[axis][2] = Real(0.5) * upper * upper;
    }
  }
  [[nodiscard]] BRECCIA_HD bool inside() const {
    constexpr unsigned last = grid::kTileWidth - kStencil;
    return static_cast<unsigned>(start[0]) <= last && static_cast<unsigned>(start[1]) <= last &&
           static_cast<unsigned>(start[2]) <= last;
  }
  [[nodiscard]] BRECCIA_HD int node() const { return read_node(start[0], start[1], start[2]); }
};

/// sum w n over the nodes, and sum w r n about the particle.
template <class Real>
struct Moments {
  Real value, x, y, z;
};

template <class Real>
BRECCIA_HD Moments<Real> gather(const Real* nodes, const Stencil<Real>& s) {
  Moments<Real> m{0, 0, 0, 0};
  for (int i = 0; i < kStencil; ++i) {
    Real value = 0, y = 0, z = 0;
    for (int j = 0; j < kStencil; ++j) {
      const Real* line = nodes + read_node(i, j, 0);
      const Real below = s.weight[2][0] * line[0];
      const Real above = s.weight[2][2] * line[2];
      const Real sum = (below + above) + s.weight[2][1] * line[1];
      value += s.weight[1][j] * sum;
      y += static_cast<Real>(j - 1) * s.weight[1][j] * sum;
      z += s.weight[1][j] * (above - below);
    }
    m.value += s.weight[0][i] * value;
    m.x += static_cast<Real>(i - 1) * s.weight[0][i] * value;
    m.y += s.weight[0][i] * y;
    m.z += s.weight[0][i] * z;
  }
  // From moments about the nearest node to moments about the particle.
  m.x -= s.offset[0] * m.value;
  m.y -= s.offset[1] * m.value;
  m.z -= s.offset[2] * m.value;
  return m;
}

/// The grid of a tile as one particle sees it.
template <class Real>
class TileGrid {
 public:
  static constexpr bool kKeepsGradient = false;

  BRECCIA_HD TileGrid(const PassArguments<Real>& a, TileShared<Real>& shared, int thread)
      : a_(a), shared_(shared), spread_(shared.spread[thread]), mass_(shared.mass[thread]) {}

  BRECCIA_HD GridVelocity<Real> velocity(unsigned, const Motion<Real>& motion) const {
    const Stencil<Real> s(motion);
    const int node = s.inside() ? s.node() : 0;
    const Moments<Real> x = gather(shared_.velocities[kNewVelocity] + node, s);
    const Moments<Real> y = gather(shared_.velocities[kNewVelocity + 1] + node, s);
    const Moments<Real> z = gather(shared_.velocities[kNewVelocity + 2] + node, s);
    const Real c = Real(4) / a_.cell;  // (4 / dx^2) * dx, moments being in cells
    return {{x.value, y.value, z.value},
            {gather(shared_.velocities[kOldVelocity] + node, s).value,
             gather(shared_.velocities[kOldVelocity + 1] + node, s).value,
             gather(shared_.velocities[kOldVelocity + 2] + node, s).value},
            {c * x.x, c * x.y, c * x.z, c * y.x, c * y.y, c * y.z, c * z.x, c * z.y, c * z.z}};
  }

  /// Momentum and force as linear fields about the nearest node.
  BRECCIA_HD void scatter(unsigned slot, const Motion<Real>& motion, const ParticleStress<Real>& p) {
    const Stencil<Real> s(motion);
    inside_ = s.inside();
    spread_.place = {{s.offset[0], s.offset[1], s.offset[2]},
                     inside_ ? sum_node(s.start[0], s.start[1], s.start[2]) : -1};
    touched_ = inside_ ? 1U << s.start[0] | 1U << (s.start[1] + 8) | 1U << (s.start[2] + 16) : 0U;
    mass_ = motion.mass;
    const Real affine = a_.transfer.affine ? motion.mass * a_.cell : Real(0);
    const Real pull = Real(-4) / a_.cell * p.volume;
    const Vec3<Real> g = gravity_of(a_, slot);
    const Mat3<Real>& c = p.gradient;
    const Sym3<Real>& tau = p.tau;
    set(s, 0, 0, motion.mass * motion.velocity[0], affine * c.xx, affine * c.xy, affine * c.xz);
    set(s, 1, 0, motion.mass * motion.velocity[1], affine * c.yx, affine * c.yy, affine * c.yz);
    set(s, 2, 0, motion.mass * motion.velocity[2], affine * c.zx, affine * c.zy, affine * c.zz);
    set(s, 0, 1, motion.mass * g.x, pull * tau.xx, pull * tau.xy, pull * tau.xz);
    set(s, 1, 1, motion.mass * g.y, pull * tau.xy, pull * tau.yy, pull * tau.yz);
    set(s, 2, 1, motion.mass * g.z, pull * tau.xz, pull * tau.yz, pull * tau.zz);
  }

  [[nodiscard]] BRECCIA_HD bool inside() const { return inside_; }
  [[nodiscard]] BRECCIA_HD unsigned touched() const { return touched_; }

 private:
  BRECCIA_HD void set(const Stencil<Real>& s, int axis, int kind, Real value, Real x, Real y, Real z) {
    spread_.channel[axis][kind] = {value - s.offset[0] * x - s.offset[1] * y - s.offset[2] * z, x, y, z};
  }

  const PassArguments<Real>& a_;
  TileShared<Real>& shared_;
  Spread<Real>& spread_;
  Real& mass_;
  bool inside_ = true;
  unsigned touched_ = 0;
};

/// Index of the block that holds a node of the tile, or kNoBlock.
template <class Real>
BRECCIA_HD unsigned block_of(const GridView<Real>& grid, unsigned tile, NodePosition n) {
  return grid.neighbours[tile * 27 + static_cast<unsigned>((block_of_tile_node(n.x) * 3 + block_of_tile_node(n.y)) * 3 +
                                                           block_of_tile_node(n.z))];
}

template <class Real>
BRECCIA_HD void load_tile(const PassArguments<Real>& a, unsigned tile, int thread, TileShared<Real>& shared) {
  for (int n = thread; n < kTileNodes; n += kPassThreads) {
    const NodePosition at = node_position<grid::kTileWidth>(n);
    const unsigned block = block_of(a.grid, tile, at);
    const auto place = static_cast<unsigned>(
        node_place<grid::kBlockWidth>(node_of_tile_node(at.x), node_of_tile_node(at.y), node_of_tile_node(at.z)));
    const Real* from = a.grid.velocities + std::size_t{block} * kSums * grid::kBlockNodes + place;
    for (int c = 0; c < kVelocities; ++c) {
      // No particle reaches a node of a block that does not exist.
      shared.velocities[c][read_node(at.x, at.y, at.z)] =
          block == grid::kNoBlock ? Real(0) : from[c * grid::kBlockNodes];
    }
  }
}

/// Weight along one axis of the node that is `step` (-1, 0, 1) cells from the nearest one.
template <class Real>
BRECCIA_HD Real weight_of(int step, Real d) {
  const Real reach = Real(0.5) + static_cast<Real>(step) * d;
  return step == 0 ? Real(0.75) - d * d : Real(0.5) * reach * reach;
}

/// Adds what `count` particles have spread: warp `axis` momentum and force along it, warp 3 the mass.
template <class Real>
__device__ __forceinline__ void add_spread(TileShared<Real>& shared, int count, int warp, int lane) {
  const int i = lane / 9 - 1, j = lane / 3 % 3 - 1, k = lane % 3 - 1;
  const int node = sum_node(i + 1, j + 1, k + 1);
  const Real x = static_cast<Real>(i), y = static_cast<Real>(j), z = static_cast<Real>(k);
  for (int n = 0; n < count; ++n) {
    const typename Spread<Real>::Place place = shared.spread[n].place;
    if (lane < kStencilNodes && place.start >= 0) {
      const Real weight = weight_of(i, place.offset[0]) * weight_of(j, place.offset[1]) * weight_of(k, place.offset[2]);
      const int at = place.start + node;
      if (warp < 3) {
        const typename Spread<Real>::Linear p = shared.spread[n].channel[warp][0];
        const typename Spread<Real>::Linear f = shared.spread[n].channel[warp][1];
        shared.sums[kMomentum + warp][at] += weight * (p.value + p.x * x + p.y * y + p.z * z);
        shared.sums[kForce + warp][at] += weight * (f.value + f.x * x + f.y * y + f.z * z);
      } else {
        shared.sums[kMass][at] += weight * shared.mass[n];
      }
    }
    __syncwarp();  // the next particle shares nodes with this one, on other lanes
  }
}

__device__ __forceinline__ PackedBox box_of(unsigned touched) {
  PackedBox box = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto bits = static_cast<int>(touched >> (8 * axis) & 255U);
    if (bits == 0) return kEmptyBox;
    box |= packed_axis(__ffs(bits) - 1, 31 - __clz(bits) + kStencil - 1, axis);
  }
  return box;
}

/// The sums of the box to memory.
template <class Real>
__device__ __forceinline__ void store_tile(const PassArguments<Real>& a, unsigned tile, int thread,
                                           const TileShared<Real>& shared) {
  const PackedBox box = box_of(shared.touched);
  if (thread == 0) a.grid.boxes[tile] = box;
  Real* to = a.grid.partial_sums + std::size_t{tile} * kSums * kTileNodes;
  for (int n = thread; n < kTileNodes; n += kPassThreads) {
    const NodePosition at = node_position<grid::kTileWidth>(n);
    if (!box_holds(box, at.x, 0) || !box_holds(box, at.y, 1) || !box_holds(box, at.z, 2)) continue;
    const int node = sum_node(at.x, at.y, at.z);
    for (int c = 0; c < kSums; ++c) to[c * kTileNodes + n] = shared.sums[c][node];
    // Mass in a block that no particle could reach at the last sorting: one has drifted more than the margin allows.
    if (block_of(a.grid, tile, at) == grid::kNoBlock && shared.sums[kMass][node] != Real(0)) atomicAdd(a.strayed, 1U);
  }
}

template <class Real>
__global__ void __launch_bounds__(kPassThreads, kPassBlocks<Real>) tile_pass(PassArguments<Real> a) {
  BRECCIA_SHARED(TileShared<Real>, shared);
  const int thread = static_cast<int>(threadIdx.x);
  const unsigned tile = a.only.tiles == nullptr ? blockIdx.x : a.only.tiles[blockIdx.x];
  const unsigned first = a.grid.first[tile];
  const auto particles = static_cast<int>(a.grid.first[tile + 1] - first);

  if (a.gather) load_tile(a, tile, thread, shared);
  if (a.scatter) {
    for (int n = thread; n < kSums * kSumNodes; n += kPassThreads) (&shared.sums[0][0])[n] = Real(0);
  }
  shared.work[thread] = {};
  if (thread == 0) shared.touched = 0;
  __syncthreads();

  for (int done = 0; done < particles; done += kPassThreads) {
    const int left = particles - done;
    unsigned touched = 0;
    if (thread < left) {
      TileGrid<Real> grid(a, shared, thread);
      shared.work[thread].add(pass_over_particle(a, first + static_cast<unsigned>(done + thread), grid));
      touched = grid.touched();
      if (!grid.inside()) atomicAdd(a.strayed, 1U);
    }
    touched = __reduce_or_sync(0xffffffffU, touched);
    if (thread % 32 == 0) atomicOr(&shared.touched, touched);
    __syncthreads();
    if (a.scatter) add_spread(shared, left < kPassThreads ? left : kPassThreads, thread / 32, thread % 32);
    __syncthreads();
  }
  if (a.scatter) store_tile(a, tile, thread, shared);
  if (thread < 32) add_work(shared.work, thread, a.sums[tile]);
}

template <class Real>
void prepare_tile_pass() {
  check(cudaFuncSetAttribute(&tile_pass<Real>, cudaFuncAttributeMaxDynamicSharedMemorySize, sizeof(TileShared<Real>)),
        "shared memory of the tile pass");
}

template <class Real>
void launch_tile_pass(const PassArguments<Real>& a, cudaStream_t stream) {
  const unsigned tiles = a.only.count == TileList::kAll ? a.grid.tiles : a.only.count;
  if (tiles == 0) return;
  BRECCIA_LAUNCH(tile_pass<Real>, dim3(tiles), dim3(kPassThreads), sizeof(TileShared<Real>), stream, a);
  check(cudaGetLastError(), "launch of the tile pass");
}

}  // namespace breccia::cuda

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
/// Nodes from one plane of the tile in shared memory to the next: three more than it holds, so that the 27 nodes of a
/// stencil lie in almost as many banks.
inline constexpr int kPlane = grid::kTileWidth * grid::kTileWidth + 3;
inline constexpr int kSharedNodes = grid::kTileWidth * kPlane;

BRECCIA_HD int shared_node(int x, int y, int z) { return x * kPlane + y * grid::kTileWidth + z; }

/// What a particle gives to its 27 nodes: node (r) gets w (value + slope . r), r in cells from the nearest node.
template <class Real>
struct alignas(16) Spread {
  struct alignas(4 * sizeof(Real) < 16 ? 4 * sizeof(Real) : 16) Linear {
    Real value, x, y, z;
  };
  Linear channel[3][2];  ///< [axis] momentum, force
  Real weight[3][kStencil];
  Real mass;
  int start;  ///< first node; negative: nothing to give
};

template <class Real>
struct TileShared {
  Real velocities[kVelocities][kSharedNodes];
  Real sums[kSums][kSharedNodes];
  Spread<Real> spread[kPassThreads];
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
  [[nodiscard]] BRECCIA_HD int node() const { return shared_node(start[0], start[1], start[2]); }
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
      const Real* line = nodes + shared_node(i, j, 0);
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

  BRECCIA_HD TileGrid(const PassArguments<Real>& a, TileShared<Real>& shared, Spread<Real>& spread)
      : a_(a), shared_(shared), spread_(spread) {}

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
    spread_.start = inside_ ? s.node() : -1;
    touched_ = inside_ ? 1U << s.start[0] | 1U << (s.start[1] + 8) | 1U << (s.start[2] + 16) : 0U;
    for (int axis = 0; axis < 3; ++axis) {
      for (int n = 0; n < kStencil; ++n) spread_.weight[axis][n] = s.weight[axis][n];
    }
    spread_.mass = motion.mass;
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
      shared.velocities[c][shared_node(at.x, at.y, at.z)] =
          block == grid::kNoBlock ? Real(0) : from[c * grid::kBlockNodes];
    }
  }
}

/// Adds what `count` particles have spread: warp `axis` momentum and force along it, warp 3 the mass.
template <class Real>
__device__ __forceinline__ void add_spread(TileShared<Real>& shared, int count, int warp, int lane) {
  const int i = lane / 9, j = lane / 3 % 3, k = lane % 3;
  const int node = shared_node(i, j, k);
  const Real x = static_cast<Real>(i - 1), y = static_cast<Real>(j - 1), z = static_cast<Real>(k - 1);
  for (int n = 0; n < count; ++n) {
    const Spread<Real>& s = shared.spread[n];
    if (lane < kStencilNodes && s.start >= 0) {
      const Real weight = s.weight[0][i] * s.weight[1][j] * s.weight[2][k];
      const int at = s.start + node;
      if (warp < 3) {
        const typename Spread<Real>::Linear p = s.channel[warp][0], f = s.channel[warp][1];
        shared.sums[kMomentum + warp][at] += weight * (p.value + p.x * x + p.y * y + p.z * z);
        shared.sums[kForce + warp][at] += weight * (f.value + f.x * x + f.y * y + f.z * z);
      } else {
        shared.sums[kMass][at] += weight * s.mass;
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
    const int node = shared_node(at.x, at.y, at.z);
    for (int c = 0; c < kSums; ++c) to[c * kTileNodes + n] = shared.sums[c][node];
    // Mass in a block that no particle could reach at the last sorting: one has drifted more than the margin allows.
    if (block_of(a.grid, tile, at) == grid::kNoBlock && shared.sums[kMass][node] != Real(0)) atomicAdd(a.strayed, 1U);
  }
}

template <class Real>
__global__ void __launch_bounds__(kPassThreads, kPassBlocks<Real>) tile_pass(PassArguments<Real> a) {
  BRECCIA_SHARED(TileShared<Real>, shared);
  const int thread = static_cast<int>(threadIdx.x);
  const unsigned tile = blockIdx.x;
  const unsigned first = a.grid.first[tile];
  const auto particles = static_cast<int>(a.grid.first[tile + 1] - first);

  if (a.gather) load_tile(a, tile, thread, shared);
  if (a.scatter) {
    for (int n = thread; n < kSums * kSharedNodes; n += kPassThreads) (&shared.sums[0][0])[n] = Real(0);
  }
  shared.work[thread] = {};
  if (thread == 0) shared.touched = 0;
  __syncthreads();

  for (int done = 0; done < particles; done += kPassThreads) {
    const int left = particles - done;
    unsigned touched = 0;
    if (thread < left) {
      TileGrid<Real> grid(a, shared, shared.spread[thread]);
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
  if (a.grid.tiles == 0) return;
  BRECCIA_LAUNCH(tile_pass<Real>, dim3(a.grid.tiles), dim3(kPassThreads), sizeof(TileShared<Real>), stream, a);
  check(cudaGetLastError(), "launch of the tile pass");
}

}  // namespace breccia::cuda

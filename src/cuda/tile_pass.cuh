// The pass over one tile by one thread block: velocities of its nodes to shared memory, G2P, update and stress one
// thread a particle, P2G (tile_scatter.cuh), sums to memory. A run repeats bit for bit.
#pragma once

#include "cuda/check.hpp"
#include "cuda/device_runtime.hpp"
#include "cuda/launchers.hpp"
#include "cuda/node_order.hpp"
#include "cuda/particle_update.hpp"
#include "cuda/tile_scatter.cuh"
#include "cuda/work_sums.cuh"

namespace breccia::cuda {

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
      : a_(a), shared_(shared), thread_(thread) {}

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
    if (!inside_) return give_nothing();  // the run ends at the next sorting
    touched_ = 1U << s.start[0] | 1U << (s.start[1] + 8) | 1U << (s.start[2] + 16);
    shared_.start[thread_] = sum_node(s.start[0], s.start[1], s.start[2]);
    shared_.mass[thread_] = motion.mass;
    const Real affine = a_.transfer.affine ? motion.mass * a_.cell : Real(0);
    const Real pull = Real(-4) / a_.cell * p.volume;
    const Vec3<Real> g = gravity_of(a_, slot);
    const Mat3<Real>& c = p.gradient;
    const Sym3<Real> f = pull * p.tau;
    Spread<Real>& to = shared_.spread[thread_];
    to.momentum[0] = about_node(s, motion.mass * motion.velocity[0], affine * c.xx, affine * c.xy, affine * c.xz);
    to.momentum[1] = about_node(s, motion.mass * motion.velocity[1], affine * c.yx, affine * c.yy, affine * c.yz);
    to.momentum[2] = about_node(s, motion.mass * motion.velocity[2], affine * c.zx, affine * c.zy, affine * c.zz);
    to.force[0] = about_node(s, motion.mass * g.x, f.xx, f.xy, f.xz).value;
    to.force[1] = about_node(s, motion.mass * g.y, f.xy, f.yy, f.yz).value;
    to.force[2] = about_node(s, motion.mass * g.z, f.xz, f.yz, f.zz).value;
    to.slope = f;
    for (int axis = 0; axis < 3; ++axis) to.offset[axis] = s.offset[axis];
  }

  [[nodiscard]] BRECCIA_HD bool inside() const { return inside_; }
  [[nodiscard]] BRECCIA_HD unsigned touched() const { return touched_; }

 private:
  BRECCIA_HD void give_nothing() {
    shared_.spread[thread_] = {};
    shared_.mass[thread_] = Real(0);
    shared_.start[thread_] = 0;
  }
  /// A field given about the particle.
  BRECCIA_HD static Linear<Real> about_node(const Stencil<Real>& s, Real value, Real x, Real y, Real z) {
    return {value - s.offset[0] * x - s.offset[1] * y - s.offset[2] * z, x, y, z};
  }

  const PassArguments<Real>& a_;
  TileShared<Real>& shared_;
  int thread_;
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
    for (int c = 0; c < kSums; ++c) to[c * kTileNodes + n] = sum_of_parts(shared, c, node);
    // Mass in a block that no particle could reach at the last sorting: one has drifted more than the margin allows.
    if (block_of(a.grid, tile, at) == grid::kNoBlock && sum_of_parts(shared, kMass, node) != Real(0)) {
      atomicAdd(a.strayed, 1U);
    }
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
  if (a.scatter) clear_sums(shared, thread);
  ThreadWork work;
  if (thread == 0) shared.touched = 0;
  __syncthreads();

  for (int done = 0; done < particles; done += kPassThreads) {
    const int left = particles - done;
    unsigned touched = 0;
    if (thread < left) {
      TileGrid<Real> grid(a, shared, thread);
      work.add(pass_over_particle(a, first + static_cast<unsigned>(done + thread), grid));
      touched = grid.touched();
      if (!grid.inside()) atomicAdd(a.strayed, 1U);
    }
    touched = __reduce_or_sync(0xffffffffU, touched);
    if (thread % 32 == 0) atomicOr(&shared.touched, touched);
    __syncthreads();
    if (a.scatter) add_spread(shared, left < kPassThreads ? left : kPassThreads, thread / 32, thread % 32);
    __syncthreads();
  }
  shared.work[thread] = work;
  if (a.scatter) store_tile(a, tile, thread, shared);
  __syncthreads();
  if (thread < 32) add_work(shared.work, thread, a.sums[tile]);
}

template <class Real>
std::string why_no_tile_pass() {
  constexpr std::size_t needed = sizeof(TileShared<Real>);
  int device = 0;
  int most = 0;
  cudaError_t status = cudaGetDevice(&device);
  if (status == cudaSuccess) status = cudaDeviceGetAttribute(&most, cudaDevAttrMaxSharedMemoryPerBlockOptin, device);
  if (status == cudaSuccess && static_cast<std::size_t>(most) < needed) {
    return "it has " + std::to_string(most) + " bytes of shared memory for a thread block, and a tile takes " +
           std::to_string(needed);
  }
  if (status == cudaSuccess) {
    status = cudaFuncSetAttribute(&tile_pass<Real>, cudaFuncAttributeMaxDynamicSharedMemorySize, needed);
  }
  if (status == cudaSuccess) return "";
  (void)cudaGetLastError();
  return cudaGetErrorString(status);
}

template <class Real>
void prepare_tile_pass() {
  const std::string why_not = why_no_tile_pass<Real>();
  if (!why_not.empty()) {
    throw UsageError("this device cannot run in this precision: " + why_not +
                     "; use --device host, or another numerics.precision or device");
  }
  load(&tile_pass<Real>);
}

template <class Real>
void launch_tile_pass(const PassArguments<Real>& a, cudaStream_t stream) {
  const unsigned tiles = a.only.count == TileList::kAll ? a.grid.tiles : a.only.count;
  if (tiles == 0) return;
  BRECCIA_LAUNCH(tile_pass<Real>, dim3(tiles), dim3(kPassThreads), sizeof(TileShared<Real>), stream, a);
  check(cudaGetLastError(), "launch of the tile pass");
}

}  // namespace breccia::cuda

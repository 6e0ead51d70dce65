// The pass over one tile by one thread block: velocities of its nodes to shared memory, G2P, update and stress one
// thread a particle, then P2G one lane a node of the stencil. The particles of a round are dealt out to parts, each
// with sums of its own, and the channels of a part to warps: every sum is added to by one warp, particle after
// particle, so there is nothing to be made atomic, and it does not depend on the order in which warps run: a run
// repeats bit for bit.
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
inline constexpr unsigned kStencilLanes = (1U << kStencilNodes) - 1;

/// Velocities in shared memory: threads read nodes of their own. Planes are shifted by as many banks as the four cells
/// of a row take, so that the particles of neighbouring rows and planes do not meet.
inline constexpr int kReadPlane = grid::kTileWidth * grid::kTileWidth + 4;
BRECCIA_HD constexpr int read_node(int x, int y, int z) { return x * kReadPlane + y * grid::kTileWidth + z; }
inline constexpr int kReadNodes = read_node(grid::kTileWidth - 1, grid::kTileWidth - 1, grid::kTileWidth - 1) + 1;
/// Sums in shared memory: lanes add to the 27 nodes of one stencil, of which two share a bank.
inline constexpr int kSumPlane = grid::kTileWidth * grid::kTileWidth + kStencil;
BRECCIA_HD constexpr int sum_node(int x, int y, int z) { return x * kSumPlane + y * grid::kTileWidth + z; }
inline constexpr int kSumNodes = sum_node(grid::kTileWidth - 1, grid::kTileWidth - 1, grid::kTileWidth - 1) + 1;

/// A linear field about the nearest node: node (r) gets w (value + slope . r), r in cells.
template <class Real>
struct alignas(16) Linear {
  Real value, x, y, z;
};

/// What a particle gives to its 27 nodes. All members are read at once by all lanes, 16 bytes at a time.
template <class Real>
struct alignas(16) Spread {
  Linear<Real> momentum[3];
  Real force[3];
  Sym3<Real> slope;  ///< of the force
  Real offset[3];    ///< from the nearest node [cells]
};

/// Parts of the particles with sums of their own: the fewer warps share a particle, the less often its weights are
/// found, and the more shared memory is taken.
inline constexpr int kParts = 2;

template <class Real>
struct TileShared {
  union {
    Spread<Real> spread[kPassThreads];
    ThreadWork work[kPassThreads];  ///< once the last particle is done
  };
  Real mass[kPassThreads];
  int start[kPassThreads];  ///< first node of the stencil
  Real velocities[kVelocities][kReadNodes];
  Real sums[kParts][kSums][kSumNodes];
  unsigned touched;  ///< 8 bits an axis: first nodes of the stencils

  BRECCIA_HD TileShared() {}
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

/// Weight along one axis of one node of a stencil, for any particle: centre - d^2 at the nearest node, (1/2 -+ d)^2 / 2
/// beside it, without a choice between the two.
template <class Real>
class NodeWeight {
 public:
  /// step: -1, 0, 1 cells from the nearest node.
  BRECCIA_HD explicit NodeWeight(int step)
      : shift_(step == 0 ? Real(0) : Real(0.5)),
        slope_(step == 0 ? Real(1) : static_cast<Real>(step)),
        most_(step == 0 ? Real(0.75) : Real(0)),
        square_(step == 0 ? Real(-1) : Real(0.5)) {}
  BRECCIA_HD Real operator()(Real offset) const {
    const Real reach = shift_ + slope_ * offset;
    return most_ + square_ * (reach * reach);
  }

 private:
  Real shift_, slope_, most_, square_;
};

/// The node of a stencil that a lane adds to.
template <class Real>
struct StencilLane {
  BRECCIA_HD explicit StencilLane(int lane) : StencilLane(lane / 9 - 1, lane / 3 % 3 - 1, lane % 3 - 1) {}
  BRECCIA_HD StencilLane(int i, int j, int k)
      : weight{NodeWeight<Real>(i), NodeWeight<Real>(j), NodeWeight<Real>(k)},
        step{static_cast<Real>(i), static_cast<Real>(j), static_cast<Real>(k)},
        node(sum_node(i + 1, j + 1, k + 1)) {}
  NodeWeight<Real> weight[3];
  Real step[3];
  int node;
};

/// Momentum and mass of a particle, as one warp takes them to the nodes.
template <class Real>
struct GivenMomentum {
  static constexpr int kFirst = kMomentum, kCount = 3;
  static constexpr bool kWithMass = true;

  BRECCIA_HD GivenMomentum(const TileShared<Real>& shared, int n)
      : p{shared.spread[n].momentum[0], shared.spread[n].momentum[1], shared.spread[n].momentum[2]},
        offset{shared.spread[n].offset[0], shared.spread[n].offset[1], shared.spread[n].offset[2]},
        mass(shared.mass[n]) {}
  BRECCIA_HD void add(Real weight, const Real (&step)[3], Real (&total)[4]) const {
    for (int c = 0; c < 3; ++c) {
      total[c] += weight * (p[c].value + p[c].x * step[0] + p[c].y * step[1] + p[c].z * step[2]);
    }
    total[3] += weight * mass;
  }

  Linear<Real> p[3];
  Real offset[3];
  Real mass;
};

/// Force likewise.
template <class Real>
struct GivenForce {
  static constexpr int kFirst = kForce, kCount = 3;
  static constexpr bool kWithMass = false;

  BRECCIA_HD GivenForce(const TileShared<Real>& shared, int n)
      : force{shared.spread[n].force[0], shared.spread[n].force[1], shared.spread[n].force[2]},
        slope(shared.spread[n].slope),
        offset{shared.spread[n].offset[0], shared.spread[n].offset[1], shared.spread[n].offset[2]} {}
  BRECCIA_HD void add(Real weight, const Real (&step)[3], Real (&total)[4]) const {
    total[0] += weight * (force[0] + slope.xx * step[0] + slope.xy * step[1] + slope.xz * step[2]);
    total[1] += weight * (force[1] + slope.xy * step[0] + slope.yy * step[1] + slope.yz * step[2]);
    total[2] += weight * (force[2] + slope.xz * step[0] + slope.yz * step[1] + slope.zz * step[2]);
  }

  Real force[3];
  Sym3<Real> slope;
  Real offset[3];
};

/// Adds what particles [begin, end) give to the sums of a part. Of particles with the same stencil one after the other
/// (sorted, most have it) a lane adds up what its node gets before it adds that to the sum.
template <class Real, template <class> class Given>
__device__ __forceinline__ void add_particles(TileShared<Real>& shared, int part, int begin, int end, int lane) {
  if (lane >= kStencilNodes || begin >= end) return;
  using Channels = Given<Real>;
  const StencilLane<Real> own(lane);
  for (int n = begin; n < end;) {
    const int start = shared.start[n];
    int next = start;
    Real total[4] = {};
    do {
      next = shared.start[n + 1 < end ? n + 1 : n];  // with the other loads: the loop waits once
      const Channels given(shared, n);
      const Real weight =
          own.weight[0](given.offset[0]) * own.weight[1](given.offset[1]) * own.weight[2](given.offset[2]);
      given.add(weight, own.step, total);
      ++n;
    } while (n < end && next == start);
    const int at = start + own.node;
    for (int c = 0; c < Channels::kCount; ++c) shared.sums[part][Channels::kFirst + c][at] += total[c];
    if (Channels::kWithMass) shared.sums[part][kMass][at] += total[3];
    __syncwarp(kStencilLanes);  // the next stencil shares nodes with this one, on other lanes
  }
}

/// Adds what `count` particles have spread.
template <class Real>
__device__ __forceinline__ void add_spread(TileShared<Real>& shared, int count, int warp, int lane) {
  static_assert(kPassThreads == 2 * kParts * 32);
  const int part = warp / 2;
  const int begin = count * part / kParts;
  const int end = count * (part + 1) / kParts;
  if (warp % 2 == 0) {
    add_particles<Real, GivenMomentum>(shared, part, begin, end, lane);
  } else {
    add_particles<Real, GivenForce>(shared, part, begin, end, lane);
  }
}

/// A channel of a node, from all parts.
template <class Real>
BRECCIA_HD Real sum_of_parts(const TileShared<Real>& shared, int channel, int node) {
  Real sum = shared.sums[0][channel][node];
  for (int part = 1; part < kParts; ++part) sum += shared.sums[part][channel][node];
  return sum;
}

template <class Real>
BRECCIA_HD void clear_sums(TileShared<Real>& shared, int thread) {
  for (int n = thread; n < kParts * kSums * kSumNodes; n += kPassThreads) (&shared.sums[0][0][0])[n] = Real(0);
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
void prepare_tile_pass() {
  if (cudaFuncSetAttribute(&tile_pass<Real>, cudaFuncAttributeMaxDynamicSharedMemorySize, sizeof(TileShared<Real>)) !=
      cudaSuccess) {
    (void)cudaGetLastError();
    throw UsageError("this device has not the " + std::to_string(sizeof(TileShared<Real>)) +
                     " bytes of shared memory that a tile takes in this precision: use --device host, or another "
                     "numerics.precision or device");
  }
}

template <class Real>
void launch_tile_pass(const PassArguments<Real>& a, cudaStream_t stream) {
  const unsigned tiles = a.only.count == TileList::kAll ? a.grid.tiles : a.only.count;
  if (tiles == 0) return;
  BRECCIA_LAUNCH(tile_pass<Real>, dim3(tiles), dim3(kPassThreads), sizeof(TileShared<Real>), stream, a);
  check(cudaGetLastError(), "launch of the tile pass");
}

}  // namespace breccia::cuda

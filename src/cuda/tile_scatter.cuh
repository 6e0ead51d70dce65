// P2G in shared memory, from what the particles of a round give: one lane a node of the stencil. The particles are
// dealt out to parts, each with sums of its own, and the channels of a part to warps: every sum is added to by one
// warp, particle after particle, so there is nothing to be made atomic, and it does not depend on the order in which
// warps run.
#pragma once

#include "cuda/tile_shared.cuh"

namespace breccia::cuda {

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
  static constexpr int kFirst = kMomentum;
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
  static constexpr int kFirst = kForce;
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
    for (int c = 0; c < 3; ++c) shared.sums[part][Channels::kFirst + c][at] += total[c];
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

}  // namespace breccia::cuda

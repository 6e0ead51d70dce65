// Particles that share no node with another one need no grid (grid/lone_pass.hpp): the field of their nodes is
// v + C r, changed by a kick dt to v + dt g + (C - dt (4/dx^2) (V0/m) tau) r.
#pragma once

#include "cuda/device_runtime.hpp"
#include "cuda/launchers.hpp"
#include "cuda/particle_update.hpp"
#include "cuda/work_sums.cuh"

namespace breccia::cuda {

/// In place of a grid: what the last scatter of a particle does to its own nodes.
template <class Real>
class LoneGrid {
 public:
  static constexpr bool kKeepsGradient = true;

  BRECCIA_HD explicit LoneGrid(const PassArguments<Real>& a) : a_(a) {}

  BRECCIA_HD GridVelocity<Real> velocity(unsigned slot, const Motion<Real>& m) const {
    const Vec3<Real> v{m.velocity[0], m.velocity[1], m.velocity[2]};
    const unsigned n = slot - a_.first_lone;
    const Real* pull = a_.lone_pull;
    const Sym3<Real> rate{pull[n],
                          pull[a_.lone + n],
                          pull[2 * a_.lone + n],
                          pull[3 * a_.lone + n],
                          pull[4 * a_.lone + n],
                          pull[5 * a_.lone + n]};
    const Sym3<Real> change = a_.kick * rate;
    // Without C in the momentum (FLIP) the nodes move with v alone.
    Mat3<Real> c{};
    if (a_.transfer.affine) c = load_gradient(a_.particles, slot);
    return {v + a_.kick * gravity_of(a_, slot),
            v,
            {c.xx - change.xx, c.xy - change.xy, c.xz - change.xz, c.yx - change.xy, c.yy - change.yy, c.yz - change.yz,
             c.zx - change.xz, c.zy - change.yz, c.zz - change.zz}};
  }

  BRECCIA_HD void scatter(unsigned slot, const Motion<Real>& m, const ParticleStress<Real>& p) const {
    const Sym3<Real> rate = (Real(4) / (a_.cell * a_.cell) * (p.volume / m.mass)) * p.tau;
    const Real values[6] = {rate.xx, rate.yy, rate.zz, rate.xy, rate.xz, rate.yz};
    for (unsigned c = 0; c < 6; ++c) a_.lone_pull[c * a_.lone + slot - a_.first_lone] = values[c];
  }

 private:
  const PassArguments<Real>& a_;
};

template <class Real>
__global__ void __launch_bounds__(kPassThreads) lone_pass(PassArguments<Real> a) {
  struct Shared {
    ThreadWork work[kPassThreads];
  };
  BRECCIA_SHARED(Shared, shared);
  const unsigned thread = threadIdx.x;
  const unsigned n = blockIdx.x * kPassThreads + thread;
  shared.work[thread] = {};
  if (n < a.lone) {
    LoneGrid<Real> grid(a);
    shared.work[thread].add(pass_over_particle(a, a.first_lone + n, grid));
  }
  __syncthreads();
  if (thread < 32) add_work(shared.work, static_cast<int>(thread), a.sums[a.grid.tiles + blockIdx.x]);
}

}  // namespace breccia::cuda

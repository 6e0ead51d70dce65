// Particles that share no node with another one need no grid. All momentum and mass on their nodes is their own, so the
// field of the nodes is v + C r, changed by a kick dt to v + dt g + (C - dt (4/dx^2) (V0/m) tau) r, and what G2P reads
// from it is exactly that (sum w r = 0, sum w r r^T = dx^2/4; cpu_limit.md 5). Debris would otherwise cost fifty times
// as much as rock.
#pragma once

#include "grid/pack_pass.hpp"
#include "grid/stencil.hpp"

namespace breccia::grid {

/// In place of a grid: what the last scatter of a particle does to its own nodes.
template <class P>
class LoneGrid {
  using Real = typename P::Real;
  using T = typename P::RealPack;

 public:
  static constexpr bool kKeepsGradient = true;

  BRECCIA_HD explicit LoneGrid(const PassArguments<P>& arguments) : a_(arguments) {}

  BRECCIA_HD GridVelocity<P> velocity(std::size_t i, int, const Kinematics<P>& k) const {
    const T kick(a_.kick);
    const Vec3<T> v{k.velocity[0], k.velocity[1], k.velocity[2]};
    const Sym3<T> pull = kick * pull_of(i).rate;
    const T* c = a_.affine[i].gradient;
    // Without C in the momentum (FLIP) the nodes move with v alone.
    const T kept(a_.transfer.affine ? Real(1) : Real(0));
    return {v + kick * gravity_of<P>(a_, i),
            v,
            {kept * c[0] - pull.xx, kept * c[1] - pull.xy, kept * c[2] - pull.xz, kept * c[3] - pull.xy,
             kept * c[4] - pull.yy, kept * c[5] - pull.yz, kept * c[6] - pull.xz, kept * c[7] - pull.yz,
             kept * c[8] - pull.zz}};
  }

  BRECCIA_HD void scatter(std::size_t i, int, const Kinematics<P>& k, const PackStress<P>& s, TileReport& report) {
    if (any(Stencil<P>::outside(Stencil<P>::place(k), kAnyStart))) ++report.strayed;
    const T mass = max(k.mass, T(Real(1e-30)));  // empty lanes
    pull_of(i).rate = (T(Real(4) / (a_.cell * a_.cell)) * (s.volume / mass)) * s.tau;
  }

 private:
  BRECCIA_HD LonePull<P>& pull_of(std::size_t i) const { return a_.lone_pull[i - a_.lone.first_pack]; }

  const PassArguments<P>& a_;
};

BRECCIA_HD int lanes_in(const LonePacks& lone, std::uint32_t pack, int width) {
  const int left = static_cast<int>(lone.particles) - static_cast<int>(pack) * width;
  return left < width ? left : width;
}

template <class P, class Fx>
BRECCIA_HD void pass_over_lone(const PassArguments<P>& a, const Fx& fx, std::uint32_t first, std::uint32_t last,
                               TileReport& report) {
  LoneGrid<P> grid(a);
  PackPass<P, Fx, LoneGrid<P>> packs(a, fx, grid);
  for (std::uint32_t n = first; n < last; ++n) {
    packs.run(std::size_t{a.lone.first_pack} + n, lanes_in(a.lone, n, P::kLanes), report);
  }
}

/// What a probe of the grid would find: v + dt g, C with the kick of its own stress, and the particle's own mass on its
/// nodes, sum w^2 m.
template <class P>
BRECCIA_HD void probe_lone(const ProbeArguments<P>& a) {
  Stencil<P> stencil(kAnyStart);
  for (std::uint32_t n = 0; n * P::kLanes < a.lone.particles; ++n) {
    const std::size_t pack = std::size_t{a.lone.first_pack} + n;
    const Kinematics<P>& k = a.kinematics[pack];
    const Vec3<typename P::RealPack> g = gravity_of<P>(a, pack);
    const typename P::RealPack gravity[3] = {g.x, g.y, g.z};
    const Sym3<typename P::RealPack>& r = a.lone_pull[n].rate;
    const typename P::RealPack rate[9] = {r.xx, r.xy, r.xz, r.xy, r.yy, r.yz, r.xz, r.yz, r.zz};
    stencil.set(k);
    for (int lane = 0; lane < lanes_in(a.lone, n, P::kLanes); ++lane) {
      const std::size_t slot = pack * P::kLanes + static_cast<std::size_t>(lane);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        a.new_velocity[3 * slot + axis] = k.velocity[axis][lane] + a.kick * gravity[axis][lane];
      }
      typename P::Real squares(0);
      stencil.for_each_node(lane, [&](auto weight, int, int) BRECCIA_INLINE_LAMBDA { squares += weight * weight; });
      a.node_mass[slot] = k.mass[lane] * squares;
      for (std::size_t n9 = 0; n9 < 9; ++n9) {
        a.gradient[9 * slot + n9] = a.affine[pack].gradient[n9][lane] - a.kick * rate[n9][lane];
      }
    }
  }
}

}  // namespace breccia::grid

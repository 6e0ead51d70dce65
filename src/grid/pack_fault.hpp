// What a pass must not hand on: particles that are not finite any more, or faster than the grid can follow (physics.md
// 8, cases 3 and 29). Their pack is not written back and gives nothing to the grid, so that the state before the step
// stays and the run can end with it.
#pragma once

#include "grid/pack_stress.hpp"
#include "material/state.hpp"

namespace breccia::grid {

/// Not finite where the new velocity, strain, energy or stress of a lane is not: one sum holds them all. Where there is
/// a stress already it holds strain and volume, too.
template <class P>
BRECCIA_HD typename P::RealPack sum_of_state(const Kinematics<P>& k, const material::State<typename P::RealPack>& s,
                                             const PackStress<P>& out, bool stressed) {
  const auto velocity = k.velocity[0] + k.velocity[1] + k.velocity[2];
  const auto moving = velocity + s.energy.value();
  const auto& tau = out.tau;
  if (stressed) return moving + ((tau.xx + tau.yy + tau.zz) + (tau.xy + tau.xz + tau.yz));
  return moving + (s.elastic.xx + s.elastic.yy + s.elastic.xy) + (s.elastic.xz + s.elastic.yz + s.volume.value());
}

/// True if a lane of `sum` is not finite; empty lanes count.
template <class T>
BRECCIA_HD bool any_not_finite(T sum) {
  return any(!((sum - sum) == T(scalar_of<T>(0))));
}

/// Particles whose change of J was cut.
template <class P>
BRECCIA_HD std::uint32_t clamped_lanes(typename P::RealPack increment, typename P::RealPack mass) {
  using Real = typename P::Real;
  using T = typename P::RealPack;
  const auto cut = increment < T(static_cast<Real>(material::kLeastVolumeIncrement));
  if (!any(cut)) return 0;
  const T ones = select(cut & (mass > T(Real(0))), T(Real(1)), T(Real(0)));
  return static_cast<std::uint32_t>(horizontal_sum(ones));
}

// The rest runs at most once. It is not inlined, and so static: each instruction set needs a copy of its own.

/// The first of `lanes` lanes that is not finite, or -1.
template <class T>
static int first_not_finite(T sum, int lanes) {
  for (int lane = 0; lane < lanes; ++lane) {
    const auto x = sum[lane];
    if (!(x - x == scalar_of<T>(0))) return lane;
  }
  return -1;
}

template <class P>
static int fastest_lane(const Kinematics<P>& k, int lanes) {
  using Real = typename P::Real;
  int worst = 0;
  Real fastest(-1);
  for (int lane = 0; lane < lanes; ++lane) {
    for (int axis = 0; axis < 3; ++axis) {
      const Real v = k.velocity[axis][lane];
      const Real speed = v < Real(0) ? -v : v;
      if (speed > fastest) fastest = speed, worst = lane;
    }
  }
  return worst;
}

/// Keeps the new values of `lane` of pack `i`, unless a lower slot has failed already: what is reported must not depend
/// on the threads.
template <class P>
[[gnu::noinline, gnu::cold]] static void record_fault(PassFault& fault, std::size_t i, int lane, bool finite,
                                                      const Kinematics<P>& k,
                                                      const material::State<typename P::RealPack>& s) {
  const auto slot = static_cast<std::uint32_t>(i * P::kLanes + static_cast<std::size_t>(lane));
  while (__atomic_exchange_n(&fault.lock, 1, __ATOMIC_ACQUIRE) != 0) {
  }
  if (slot < fault.slot) {
    fault.slot = slot;
    fault.finite = finite;
    for (int axis = 0; axis < 3; ++axis) fault.velocity[axis] = static_cast<double>(k.velocity[axis][lane]);
    fault.volume_change = static_cast<double>(s.volume.value()[lane]);
    fault.energy = static_cast<double>(s.energy.value()[lane]);
    fault.kirchhoff_pressure = static_cast<double>(s.kirchhoff_pressure[lane]);
    fault.damage_root = static_cast<double>(s.damage_root[lane]);
  }
  __atomic_store_n(&fault.lock, 0, __ATOMIC_RELEASE);
}

/// True if the pack must not go on; `moved`: largest |dx| of a lane [cells].
template <class P>
[[gnu::noinline, gnu::cold]] static bool found_fault(PassFault& fault, std::size_t i, int lanes, typename P::Real moved,
                                                     const Kinematics<P>& k,
                                                     const material::State<typename P::RealPack>& s,
                                                     typename P::RealPack sum) {
  const int broken = first_not_finite(sum, lanes);
  if (broken < 0 && !(moved >= typename P::Real(1))) return false;
  record_fault<P>(fault, i, broken < 0 ? fastest_lane<P>(k, lanes) : broken, broken < 0, k, s);
  return true;
}

}  // namespace breccia::grid

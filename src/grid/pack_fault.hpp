// What a pass must not hand on: particles that are not finite any more, or faster than the grid can follow (physics.md
// 8, cases 3 and 29). Their pack is not written back and gives nothing to the grid, so that the state before the step
// stays and the run can end with it.
#pragma once

#include "grid/tile.hpp"
#include "material/state.hpp"

namespace breccia::grid {

/// Lanes with a particle whose new velocity, volume, energy or stress is not finite. One sum holds them all.
template <class P>
BRECCIA_HD typename P::RealPack::Mask faulty_lanes(const Kinematics<P>& k, const material::State<typename P::RealPack>& s,
                                                   const Sym3<typename P::RealPack>& tau) {
  using T = typename P::RealPack;
  const T zero(typename P::Real(0));
  const T velocity = k.velocity[0] + k.velocity[1] + k.velocity[2];
  const T stress = (tau.xx + tau.yy + tau.zz) + (tau.xy + tau.xz + tau.yz);
  const T strain = (s.elastic.xx + s.elastic.yy) + (s.elastic.xy + s.elastic.xz + s.elastic.yz);
  const T sum = (velocity + stress) + (strain + s.volume.value() + s.energy.value());
  return (!((sum - sum) == zero)) & (k.mass > zero);
}

/// Particles whose change of J was cut.
template <class P>
BRECCIA_HD std::uint32_t clamped_lanes(typename P::RealPack increment, typename P::RealPack mass) {
  using Real = typename P::Real;
  using T = typename P::RealPack;
  const auto cut = (increment < T(static_cast<Real>(material::kLeastVolumeIncrement))) & (mass > T(Real(0)));
  if (!any(cut)) return 0;
  const T ones = select(cut, T(Real(1)), T(Real(0)));
  return static_cast<std::uint32_t>(horizontal_sum(ones));
}

/// The fastest of the first `lanes` lanes; one that is not finite comes before all others.
template <class P>
inline int worst_lane(const Kinematics<P>& k, typename P::RealPack faulty, int lanes) {
  using Real = typename P::Real;
  int worst = 0;
  Real fastest(-1);
  for (int lane = 0; lane < lanes; ++lane) {
    if (faulty[lane] > Real(0)) return lane;
    for (int axis = 0; axis < 3; ++axis) {
      const Real v = k.velocity[axis][lane];
      const Real speed = v < Real(0) ? -v : v;
      if (speed > fastest) fastest = speed, worst = lane;
    }
  }
  return worst;
}

/// Keeps the new values of the worst particle of pack `i`, unless a lower pack has failed already: what is reported must
/// not depend on the threads.
template <class P>
[[gnu::noinline, gnu::cold]] void record_fault(PassFault& fault, std::size_t i, int lanes, const Kinematics<P>& k,
                                               const material::State<typename P::RealPack>& s,
                                               typename P::RealPack::Mask faulty) {
  using Real = typename P::Real;
  using T = typename P::RealPack;
  const T flags = select(faulty, T(Real(1)), T(Real(0)));
  const int lane = worst_lane<P>(k, flags, lanes);
  const auto slot = static_cast<std::uint32_t>(i * P::kLanes + static_cast<std::size_t>(lane));
  while (__atomic_exchange_n(&fault.lock, 1, __ATOMIC_ACQUIRE) != 0) {
  }
  if (slot < fault.slot) {
    fault.slot = slot;
    fault.finite = !(flags[lane] > Real(0));
    for (int axis = 0; axis < 3; ++axis) fault.velocity[axis] = static_cast<double>(k.velocity[axis][lane]);
    fault.volume_change = static_cast<double>(s.volume.value()[lane]);
    fault.energy = static_cast<double>(s.energy.value()[lane]);
    fault.kirchhoff_pressure = static_cast<double>(s.kirchhoff_pressure[lane]);
    fault.damage_root = static_cast<double>(s.damage_root[lane]);
  }
  __atomic_store_n(&fault.lock, 0, __ATOMIC_RELEASE);
}

}  // namespace breccia::grid

// One pack of particles in registers: read, move, strain, damage, stress, written back. The physics is in material/.
#pragma once

#include "grid/stencil.hpp"
#include "material/damage.hpp"

namespace breccia::grid {

/// What G2P delivers, lanes = particles: interpolated velocities and the velocity gradient.
template <class P>
struct GridVelocity {
  using T = typename P::RealPack;
  Vec3<T> updated;   ///< sum w v^{n+1/2}
  Vec3<T> previous;  ///< sum w v^{n-1/2}
  Mat3<T> gradient;  ///< C^{n+1/2} [1/s]
};

/// Material state of pack `i` from the arrays; fields of effects that are off are zero.
template <class P, class Fx>
BRECCIA_HD material::State<typename P::RealPack> load_state(const PassArguments<P>& a, const Fx& fx, std::size_t i) {
  using T = typename P::RealPack;
  const T zero(typename P::Real(0));
  // Member by member: clearing all of it first would be a call or a slow string instruction.
  material::State<T> s;
  s.volume = a.volume[i].change;
  s.kirchhoff_pressure = a.volume[i].kirchhoff_pressure;
  if (fx.shear) {
    const T* e = a.elastic[i].strain;
    s.elastic = {e[0], e[1], e[2], e[3], e[4]};
  } else {
    s.elastic = {zero, zero, zero, zero, zero};
  }
  if (fx.energy) {
    s.energy = a.energy[i].specific;
  } else {
    s.energy.set(zero);
  }
  s.damage_root = (fx.strength || fx.damage) && !fx.fully_damaged ? a.damage_level[i].root : zero;
  if (fx.damage) {
    const T* t = a.flaws[i].total;
    s.total = {t[0], t[1], t[2], t[3], t[4], t[5]};
  } else {
    s.total = {zero, zero, zero, zero, zero, zero};
  }
  return s;
}

template <class P, class Fx>
BRECCIA_HD void store_state(const PassArguments<P>& a, const Fx& fx, std::size_t i,
                            const material::State<typename P::RealPack>& s) {
  a.volume[i].change = s.volume;
  a.volume[i].kirchhoff_pressure = s.kirchhoff_pressure;
  if (fx.shear) {
    const auto& e = s.elastic;
    a.elastic[i] = {{e.xx, e.yy, e.xy, e.xz, e.yz}};
  }
  if (fx.energy) a.energy[i].specific = s.energy;
  if (fx.damage) {
    const auto& t = s.total;
    a.damage_level[i].root = s.damage_root;
    for (int c = 0; c < 6; ++c) a.flaws[i].total[c] = (&t.xx)[c];
  }
}

/// Moves one axis by `cells` (|cells| < 1); returns the change of the nearest node.
BRECCIA_HD Pack<std::int32_t, 16> move_axis(Pack<std::int32_t, 16>& offset, Pack<float, 16> cells) {
  using F = Pack<float, 16>;
  using I = Pack<std::int32_t, 16>;
  // Adding 1.5 * 2^23 rounds to the nearest integer.
  const F magic(12582912.0F);
  const F whole = (cells + magic) - magic;
  F units = (cells - whole) * F(0x1p32F);
  // Conversion truncates; below 2^22 units the fraction matters for slow drifts.
  units = select(abs(units) < F(4194304.0F), (units + magic) - magic, units);
  units = min(max(units, F(-0x1p31F)), F(2147483520.0F));
  const I change = convert<std::int32_t>(units);
  const I sum = reinterpret<std::int32_t>(reinterpret<std::uint32_t>(offset) + reinterpret<std::uint32_t>(change));
  const I overflow = ((offset ^ sum) & (change ^ sum)) >> 31;
  const I carry = ((offset >> 31) | I(1)) & overflow;
  offset = sum;
  return convert<std::int32_t>(whole) + carry;
}

BRECCIA_HD Pack<std::int32_t, 8> move_axis(Pack<double, 8>& offset, Pack<double, 8> cells) {
  using D = Pack<double, 8>;
  const D magic(6755399441055744.0);  // 1.5 * 2^52
  const D moved = offset + cells;
  const D whole = (moved + magic) - magic;
  offset = moved - whole;
  return convert<std::int32_t>(whole);
}

/// ASFLIP velocity and position update (physics.md 5 step 5). Returns the largest |dx| along an axis [cells].
template <class P>
BRECCIA_HD typename P::RealPack advance(const PassArguments<P>& a, Kinematics<P>& k, const GridVelocity<P>& grid) {
  using Real = typename P::Real;
  using T = typename P::RealPack;
  using I = typename P::IntPack;
  const T alpha(static_cast<Real>(a.transfer.alpha));
  const T beta(static_cast<Real>(a.transfer.beta));
  const T cells_per_speed(a.step / a.cell);
  const T* updated = &grid.updated.x;
  const T* previous = &grid.previous.x;
  I node = k.node;
  T largest(Real(0));
  for (int axis = 0; axis < 3; ++axis) {
    const T d = alpha * (k.velocity[axis] - previous[axis]);
    k.velocity[axis] = updated[axis] + d;
    const T cells = cells_per_speed * (updated[axis] + beta * d);
    largest = max(largest, abs(cells));
    const I change = move_axis(k.offset[axis], cells);
    node += change << (8 * axis);
  }
  k.node = node;
  return select(k.mass > T(Real(0)), largest, T(Real(0)));
}

/// Strain that activates the next flaw of each lane.
template <class P>
BRECCIA_HD typename P::RealPack next_threshold(const Flaws<P>& f) {
  const auto code = reinterpret<std::int32_t>(reinterpret<std::uint32_t>(f.state) >> 16);
  return convert<typename P::Real>(reinterpret<float>(material::threshold_bits(code)));
}

/// Activates the flaws whose threshold the strain has passed; a particle crosses few thresholds in its life, so this
/// is scalar code behind one test of the pack.
template <class P>
BRECCIA_HD void activate_flaws(const PassArguments<P>& a, Flaws<P>& f, typename P::RealPack strain) {
  using Real = typename P::Real;
  if (!any(strain > next_threshold(f))) return;
  for (int l = 0; l < P::kLanes; ++l) {
    FlawState state = FlawState::of(f.state[l]);
    const material::FlawCode* code = a.flaw_codes + f.first[l];
    while (state.active < state.all && strain[l] > static_cast<Real>(material::threshold_of(state.next))) {
      ++state.active;
      state.next = state.active < state.all ? code[state.active] : material::kNeverGrows;
    }
    f.state.set(l, state.packed());
  }
}

/// Damage over one step: flaws, growth, cap (physics.md 3). The total strain of broken rock has no use any more.
template <class P>
BRECCIA_HD void grow_damage(const PassArguments<P>& a, std::size_t i, typename P::RealPack mass,
                            const material::Constants<typename P::Real>& c, material::State<typename P::RealPack>& s) {
  using Real = typename P::Real;
  using T = typename P::RealPack;
  Flaws<P>& f = a.flaws[i];
  if (any(material::principal_strain_may_exceed(s, next_threshold(f)))) {
    activate_flaws(a, f, material::principal_strain(s));
  }
  using I = typename P::IntPack;
  const T active = convert<Real>(f.state & I(255));
  const auto growing = (active > T(Real(0))) & (s.damage_root < T(Real(1)));
  if (!any(growing)) return;
  const T all = convert<Real>((f.state >> 8) & I(255));
  // All lanes that grow have flaws and mass; the others must not divide by zero.
  const T rate = T(c.crack_growth) / breccia::cbrt(select(growing, mass, T(Real(1))));
  const T root = material::grow_damage_root(s.damage_root, active, select(growing, all, T(Real(1))), rate * T(a.step));
  s.damage_root = select(growing, root, s.damage_root);
  const auto intact = s.damage_root < T(Real(1));
  for (int n = 0; n < 6; ++n) (&s.total.xx)[n] = select(intact, (&s.total.xx)[n], T(Real(0)));
}

}  // namespace breccia::grid

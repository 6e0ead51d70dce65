// One particle in registers: read, moved, strained, damaged, stressed, written back; grid/particle_pack.hpp and
// grid/pack_pass.hpp for a thread instead of a pack. The physics is in material/.
#pragma once

#include "cuda/step_arguments.hpp"
#include "material/constitutive.hpp"
#include "material/damage.hpp"

namespace breccia::cuda {

/// Where a particle is and how it moves.
template <class Real>
struct Motion {
  typename OffsetOf<Real>::type offset[3];
  std::int32_t node;  ///< nearest node inside the tile: 3 x 8 bits, each + kNodeBias
  Real velocity[3];
  Real mass;
};

/// What G2P delivers.
template <class Real>
struct GridVelocity {
  Vec3<Real> updated;   ///< sum w v^{n+1/2}
  Vec3<Real> previous;  ///< sum w v^{n-1/2}
  Mat3<Real> gradient;  ///< C^{n+1/2} [1/s]
};

/// What a particle gives to the grid.
template <class Real>
struct ParticleStress {
  Mat3<Real> gradient;  ///< C^{n-1/2} [1/s]
  Real volume;          ///< reference volume m / rho0 [m3]
  Sym3<Real> tau;       ///< Kirchhoff stress [Pa]
};

/// What the pass of one particle adds to the report.
template <class Real>
struct Found {
  Real plastic_work = 0;  ///< [J]
  Real viscous_work = 0;  ///< [J]
  Real moved = 0;         ///< along an axis [cells]
};

BRECCIA_HD float offset_in_cells(std::int32_t offset) { return static_cast<float>(offset) * 0x1p-32F; }
BRECCIA_HD double offset_in_cells(double offset) { return offset; }

/// Coordinate of the first node of the stencil in the tile, 0 .. 5 inside the margin.
BRECCIA_HD int stencil_start(std::int32_t node, int axis) { return (node >> (8 * axis) & 255) - (grid::kNodeBias - 1); }

/// Moves one axis by `cells` (|cells| < 1); returns the change of the nearest node.
BRECCIA_HD std::int32_t move_axis(std::int32_t& offset, float cells) {
  // Adding 1.5 * 2^23 rounds to the nearest integer.
  constexpr float magic = 12582912.0F;
  const float whole = (cells + magic) - magic;
  float units = (cells - whole) * 0x1p32F;
  // Conversion truncates; below 2^22 units the fraction matters for slow drifts.
  units = abs(units) < 4194304.0F ? (units + magic) - magic : units;
  units = min(max(units, -0x1p31F), 2147483520.0F);
  const auto change = static_cast<std::int32_t>(units);
  const auto sum = static_cast<std::int32_t>(static_cast<std::uint32_t>(offset) + static_cast<std::uint32_t>(change));
  const std::int32_t overflow = ((offset ^ sum) & (change ^ sum)) >> 31;
  const std::int32_t carry = ((offset >> 31) | 1) & overflow;
  offset = sum;
  return static_cast<std::int32_t>(min(max(whole, -100.0F), 100.0F)) + carry;
}
BRECCIA_HD std::int32_t move_axis(double& offset, double cells) {
  constexpr double magic = 6755399441055744.0;  // 1.5 * 2^52
  const double moved = offset + cells;
  const double whole = (moved + magic) - magic;
  offset = moved - whole;
  return static_cast<std::int32_t>(min(max(whole, -100.0), 100.0));
}

template <class Real>
BRECCIA_HD Motion<Real> load_motion(const ParticleView<Real>& p, unsigned slot) {
  return {{p.offset[p.at(0, slot)], p.offset[p.at(1, slot)], p.offset[p.at(2, slot)]},
          p.node[slot],
          {p.velocity[p.at(0, slot)], p.velocity[p.at(1, slot)], p.velocity[p.at(2, slot)]},
          p.mass[slot]};
}

template <class Real>
BRECCIA_HD void store_motion(const ParticleView<Real>& p, unsigned slot, const Motion<Real>& m) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    p.offset[p.at(axis, slot)] = m.offset[axis];
    p.velocity[p.at(axis, slot)] = m.velocity[axis];
  }
  p.node[slot] = m.node;
}

BRECCIA_HD void load_sum(const float* from, unsigned slot, unsigned stride, Accumulator<float>& sum) {
  sum.high = from[slot];
  sum.low = from[stride + slot];
}
BRECCIA_HD void load_sum(const double* from, unsigned slot, unsigned, Accumulator<double>& sum) {
  sum.high = from[slot];
}
BRECCIA_HD void store_sum(float* to, unsigned slot, unsigned stride, const Accumulator<float>& sum) {
  to[slot] = sum.high;
  to[stride + slot] = sum.low;
}
BRECCIA_HD void store_sum(double* to, unsigned slot, unsigned, const Accumulator<double>& sum) { to[slot] = sum.high; }

/// Fields of effects that are off are zero.
template <class Real, class Fx>
BRECCIA_HD material::State<Real> load_state(const ParticleView<Real>& p, const Fx& fx, unsigned slot) {
  material::State<Real> s{};
  load_sum(p.volume_change, slot, p.stride, s.volume);
  s.kirchhoff_pressure = p.kirchhoff_pressure[slot];
  if (fx.shear) {
    const Real* e = p.elastic_strain;
    s.elastic = {e[p.at(0, slot)], e[p.at(1, slot)], e[p.at(2, slot)], e[p.at(3, slot)], e[p.at(4, slot)]};
  }
  if (fx.energy) load_sum(p.internal_energy, slot, p.stride, s.energy);
  if ((fx.strength || fx.damage) && !fx.fully_damaged) s.damage_root = p.damage_root[slot];
  if (fx.damage) {
    const Real* t = p.total_strain;
    s.total = {t[p.at(0, slot)], t[p.at(1, slot)], t[p.at(2, slot)],
               t[p.at(3, slot)], t[p.at(4, slot)], t[p.at(5, slot)]};
  }
  return s;
}

template <class Real, class Fx>
BRECCIA_HD void store_state(const ParticleView<Real>& p, const Fx& fx, unsigned slot, const material::State<Real>& s) {
  store_sum(p.volume_change, slot, p.stride, s.volume);
  p.kirchhoff_pressure[slot] = s.kirchhoff_pressure;
  if (fx.shear) {
    Real* e = p.elastic_strain;
    e[p.at(0, slot)] = s.elastic.xx;
    e[p.at(1, slot)] = s.elastic.yy;
    e[p.at(2, slot)] = s.elastic.xy;
    e[p.at(3, slot)] = s.elastic.xz;
    e[p.at(4, slot)] = s.elastic.yz;
  }
  if (fx.energy) store_sum(p.internal_energy, slot, p.stride, s.energy);
  if (fx.damage) {
    Real* t = p.total_strain;
    p.damage_root[slot] = s.damage_root;
    t[p.at(0, slot)] = s.total.xx;
    t[p.at(1, slot)] = s.total.yy;
    t[p.at(2, slot)] = s.total.zz;
    t[p.at(3, slot)] = s.total.xy;
    t[p.at(4, slot)] = s.total.xz;
    t[p.at(5, slot)] = s.total.yz;
  }
}

/// Acceleration by the held and the uniform gravity [m/s2].
template <class Real>
BRECCIA_HD Vec3<Real> gravity_of(const PassArguments<Real>& a, unsigned slot) {
  const ParticleView<Real>& p = a.particles;
  if (!a.held_gravity) return a.uniform_gravity;
  return a.uniform_gravity + Vec3<Real>{p.gravity[p.at(0, slot)], p.gravity[p.at(1, slot)], p.gravity[p.at(2, slot)]};
}

/// ASFLIP velocity and position update (physics.md 5 step 5). Returns the largest |dx| along an axis [cells].
template <class Real>
BRECCIA_HD Real advance(const PassArguments<Real>& a, Motion<Real>& m, const GridVelocity<Real>& grid) {
  const Real cells_per_speed = a.step / a.cell;
  const Real updated[3] = {grid.updated.x, grid.updated.y, grid.updated.z};
  const Real previous[3] = {grid.previous.x, grid.previous.y, grid.previous.z};
  Real largest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Real d = a.transfer.alpha * (m.velocity[axis] - previous[axis]);
    m.velocity[axis] = updated[axis] + d;
    const Real cells = cells_per_speed * (updated[axis] + a.transfer.beta * d);
    largest = max(largest, abs(cells));
    m.node += static_cast<std::int32_t>(static_cast<std::uint32_t>(move_axis(m.offset[axis], cells)) << (8 * axis));
  }
  return largest;
}

/// Activates the flaws whose threshold the strain has passed. Returns active + 65536 * all.
template <class Real>
BRECCIA_HD std::int32_t activate_flaws(const PassArguments<Real>& a, unsigned slot, Real strain, std::int32_t count) {
  const ParticleView<Real>& p = a.particles;
  const std::int32_t all = count >> 16;
  std::int32_t active = count & 0xffff;
  const float* threshold = a.flaw_thresholds + p.flaw_first[slot];
  while (active < all && strain > static_cast<Real>(threshold[active])) ++active;
  const std::int32_t now = (all << 16) | active;
  p.flaw_count[slot] = now;
  p.next_threshold[slot] = active < all ? static_cast<Real>(threshold[active]) : Real(1e30);
  return now;
}

/// Damage over one step: flaws, growth, cap (physics.md 3). The total strain of broken rock has no use any more.
template <class Real>
BRECCIA_HD void grow_damage(const PassArguments<Real>& a, unsigned slot, Real mass, const material::Constants<Real>& c,
                            material::State<Real>& s) {
  std::int32_t count = a.particles.flaw_count[slot];
  const Real next = a.particles.next_threshold[slot];
  if (material::principal_strain_may_exceed(s, next)) {
    const Real strain = material::principal_strain(s);
    if (strain > next) count = activate_flaws(a, slot, strain, count);
  }
  const auto active = static_cast<Real>(count & 0xffff);
  if (!(active > Real(0) && s.damage_root < Real(1))) return;
  const Real rate = c.crack_growth / breccia::cbrt(mass);
  s.damage_root = material::grow_damage_root(s.damage_root, active, static_cast<Real>(count >> 16), rate * a.step);
  if (!(s.damage_root < Real(1))) s.total = {};
}

template <class Real>
BRECCIA_HD Mat3<Real> load_gradient(const ParticleView<Real>& p, unsigned slot) {
  const Real* c = p.velocity_gradient;
  return {c[p.at(0, slot)], c[p.at(1, slot)], c[p.at(2, slot)], c[p.at(3, slot)], c[p.at(4, slot)],
          c[p.at(5, slot)], c[p.at(6, slot)], c[p.at(7, slot)], c[p.at(8, slot)]};
}
template <class Real>
BRECCIA_HD void store_gradient(const ParticleView<Real>& p, unsigned slot, const Mat3<Real>& g) {
  Real* c = p.velocity_gradient;
  c[p.at(0, slot)] = g.xx;
  c[p.at(1, slot)] = g.xy;
  c[p.at(2, slot)] = g.xz;
  c[p.at(3, slot)] = g.yx;
  c[p.at(4, slot)] = g.yy;
  c[p.at(5, slot)] = g.yz;
  c[p.at(6, slot)] = g.zx;
  c[p.at(7, slot)] = g.zy;
  c[p.at(8, slot)] = g.zz;
}

template <class Real>
BRECCIA_HD const material::Constants<Real>& material_of(const PassArguments<Real>& a, unsigned slot) {
  return a.materials[a.material_count == 1 ? 0 : a.particles.body_material[slot] >> 16];
}

/// The pass over the particle in `slot`: G2P, update, stress, P2G, or one half of it. `Grid` has velocity(slot, motion)
/// and scatter(slot, motion, stress), and says by kKeepsGradient whether C is stored at every step.
template <class Real, class Grid>
BRECCIA_HD Found<Real> pass_over_particle(const PassArguments<Real>& a, unsigned slot, Grid& grid) {
  const material::RuntimeEffects& fx = a.effects;
  const ParticleView<Real>& p = a.particles;
  const material::Constants<Real>& c = material_of(a, slot);
  Motion<Real> motion = load_motion(p, slot);
  material::State<Real> state = load_state(p, fx, slot);
  ParticleStress<Real> out{};
  Found<Real> found;
  if (a.gather) {
    const GridVelocity<Real> velocity = grid.velocity(slot, motion);
    out.gradient = velocity.gradient;
    found.moved = advance(a, motion, velocity);
    const Real increment = material::update_strain(fx, c, state, out.gradient, a.step);
    if (increment < static_cast<Real>(material::kLeastVolumeIncrement)) atomicAdd(a.clamped, 1U);
    if (fx.damage) grow_damage(a, slot, motion.mass, c, state);
    store_motion(p, slot, motion);
    if (Grid::kKeepsGradient || !a.scatter) store_gradient(p, slot, out.gradient);
  } else {
    out.gradient = load_gradient(p, slot);
  }
  if (a.scatter) {
    material::Dissipation<Real> lost;
    out.tau = material::update_stress(fx, c, state, out.gradient, a.stress_half_step, lost);
    out.volume = motion.mass * c.inverse_density;
    found.plastic_work = out.volume * lost.plastic;
    found.viscous_work = out.volume * lost.viscous;
    grid.scatter(slot, motion, out);
  }
  const Real sum = motion.velocity[0] + motion.velocity[1] + motion.velocity[2] + state.energy.value() +
                   state.volume.value() + (out.tau.xx + out.tau.yy + out.tau.zz);
  if (!(sum - sum == Real(0))) found.moved = static_cast<Real>(kNotFinite);
  store_state(p, fx, slot, state);
  return found;
}

}  // namespace breccia::cuda

// The pass over one pack of particles: velocities from the grid, particle update, stress, momentum to the grid in one
// sweep (physics.md 5; cpu_limit.md 3), or one half of it where the time step must stop between particles and grid
// (window starts). Where the velocities come from and the momentum goes to is the business of `Grid`.
#pragma once

#include "grid/pack_fault.hpp"
#include "grid/particle_pack.hpp"

namespace breccia::grid {

/// Acceleration of pack `i` by the held and the uniform gravity [m/s2]. Arguments: PassArguments or ProbeArguments.
template <class P, class Arguments>
BRECCIA_HD Vec3<typename P::RealPack> gravity_of(const Arguments& a, std::size_t i) {
  using T = typename P::RealPack;
  Vec3<T> g{T(a.uniform_gravity.x), T(a.uniform_gravity.y), T(a.uniform_gravity.z)};
  if (a.gravity != nullptr) {
    const T* held = a.gravity[i].acceleration;
    g = g + Vec3<T>{held[0], held[1], held[2]};
  }
  return g;
}

/// Asks for the fields of a pack ahead of their use: the tile's nodes lie on too many pages for the processor to see
/// that the packs follow each other.
template <class Fields>
BRECCIA_HD void prefetch(const Fields* pack) {
  constexpr std::size_t kLine = 64;
  for (std::size_t n = 0; n < sizeof(Fields); n += kLine) {
    __builtin_prefetch(reinterpret_cast<const char*>(pack) + n, 1, 3);
  }
}

/// `Grid` has  GridVelocity<P> velocity(pack, lanes, kinematics)  and  scatter(pack, lanes, kinematics, stress,
/// report), and says by kKeepsGradient whether C is stored at every step.
template <class P, class Fx, class Grid>
class PackPass {
  using Real = typename P::Real;
  using T = typename P::RealPack;

 public:
  BRECCIA_HD PackPass(const PassArguments<P>& arguments, const Fx& effects, Grid& grid)
      : a_(arguments), fx_(effects), grid_(grid) {}

  /// Pack `i`, of which `lanes` lanes hold particles.
  BRECCIA_HD void run(std::size_t i, int lanes, TileReport& report) {
    Kinematics<P> k = a_.kinematics[i];
    auto state = load_state(a_, fx_, i);
    PackStress<P> out;
    out.tau = {};
    material::Dissipation<T> lost{};
    Real moved(0);
    if (a_.gather) {
      prefetch(a_.kinematics + i + 1);
      prefetch(a_.volume + i + 1);
      const GridVelocity<P> grid = grid_.velocity(i, lanes, k);
      if (fx_.shear) prefetch(a_.elastic + i + 1);
      if (fx_.energy) prefetch(a_.energy + i + 1);
      out.gradient = grid.gradient;
      moved = horizontal_max(advance(a_, k, grid));
      if (moved > report.largest_move) report.largest_move = moved;
      T increment(Real(0));
      for_each_material(i, state, [&](const material::Constants<Real>& c, material::State<T>& s) BRECCIA_INLINE_LAMBDA {
        increment = material::update_strain(fx_, c, s, out.gradient, a_.step);
        if (fx_.damage) grow_damage(a_, i, k.mass, c, s);
      });
      report.clamped += clamped_lanes<P>(increment, k.mass);
    } else {
      out.gradient = load_gradient(i);
    }
    if (a_.scatter) {
      if (fx_.damage) prefetch(a_.flaws + i + 1);
      if (fx_.damage || fx_.strength) prefetch(a_.damage_level + i + 1);
      for_each_material(i, state, [&](const material::Constants<Real>& c, material::State<T>& s) BRECCIA_INLINE_LAMBDA {
        stress(c, s, out.gradient, i, lost, out.tau);
      });
    }
    const T sum = sum_of_state<P>(k, state, out, a_.scatter);
    if ((any_not_finite(sum) || moved >= Real(1)) && found_fault<P>(*a_.fault, i, lanes, moved, k, state, sum)) return;
    if (a_.gather) {
      a_.kinematics[i] = k;
      if (Grid::kKeepsGradient || !a_.scatter) store_gradient(i, out.gradient);
    }
    if (a_.scatter) {
      out.volume = reference_volume(i, k.mass);
      report.plastic_work += static_cast<double>(horizontal_sum(out.volume * lost.plastic));
      report.viscous_work += static_cast<double>(horizontal_sum(out.volume * lost.viscous));
      grid_.scatter(i, lanes, k, out, report);
    }
    store_state(a_, fx_, i, state);
  }

 private:
  BRECCIA_HD void stress(const material::Constants<Real>& c, material::State<T>& s, const Mat3<T>& gradient,
                         std::size_t i, material::Dissipation<T>& lost, Sym3<T>& tau) {
    material::Dissipation<T> here{};
    const Sym3<T> stress_here = material::update_stress(fx_, c, s, gradient, a_.stress_half_step, here);
    if (a_.material_count == 1) {
      tau = stress_here;
      lost = here;
      return;
    }
    const auto mine = is_material(i, c);
    lost.plastic = select(mine, here.plastic, lost.plastic);
    lost.viscous = select(mine, here.viscous, lost.viscous);
    for (int n = 0; n < 6; ++n) (&tau.xx)[n] = select(mine, (&stress_here.xx)[n], (&tau.xx)[n]);
  }

  // Calls update(constants, state) once for each material present in the pack and keeps each lane's own result.
  template <class F>
  BRECCIA_HD void for_each_material(std::size_t i, material::State<T>& state, F&& update) {
    if (a_.material_count == 1) {
      update(a_.materials[0], state);
      return;
    }
    const material::State<T> before = state;
    for (int m = 0; m < a_.material_count; ++m) {
      const auto mine = is_material(i, a_.materials[m]);
      if (!any(mine)) continue;
      material::State<T> trial = before;
      update(a_.materials[m], trial);
      static_assert(sizeof(trial) % sizeof(T) == 0, "State is made of packs only");
      for (std::size_t n = 0; n < sizeof(trial) / sizeof(T); ++n) {
        T& kept = reinterpret_cast<T*>(&state)[n];
        kept = select(mine, reinterpret_cast<const T*>(&trial)[n], kept);
      }
    }
  }

  BRECCIA_HD typename T::Mask is_material(std::size_t i, const material::Constants<Real>& c) const {
    const auto index = static_cast<std::int32_t>(&c - a_.materials);
    const typename P::IntPack material = a_.identity[i].body_material >> 16;
    return convert<Real>(material) == T(static_cast<Real>(index));
  }

  BRECCIA_HD T reference_volume(std::size_t i, T mass) const {
    T inverse_density(a_.materials[0].inverse_density);
    for (int m = 1; m < a_.material_count; ++m) {
      inverse_density = select(is_material(i, a_.materials[m]), T(a_.materials[m].inverse_density), inverse_density);
    }
    return mass * inverse_density;
  }

  BRECCIA_HD void store_gradient(std::size_t i, const Mat3<T>& c) const {
    a_.affine[i] = {{c.xx, c.xy, c.xz, c.yx, c.yy, c.yz, c.zx, c.zy, c.zz}};
  }
  BRECCIA_HD Mat3<T> load_gradient(std::size_t i) const {
    const T* c = a_.affine[i].gradient;
    return {c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]};
  }

  const PassArguments<P>& a_;
  const Fx& fx_;
  Grid& grid_;
};

}  // namespace breccia::grid

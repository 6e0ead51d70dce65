// The pass over one tile: G2P, particle update, stress, P2G in one sweep (physics.md 5; cpu_limit.md 3), or one half of
// it where the time step must stop between particles and grid (window starts).
#pragma once

#include "grid/particle_pack.hpp"
#include "grid/tile_nodes.hpp"
#include "grid/transfer.hpp"

namespace breccia::grid {

/// Node values of the tile, read and written: fits the first-level cache in mixed precision.
template <class P>
struct TileScratch {
  alignas(64) typename P::Real velocities[kTileNodes * kChannels];
  alignas(64) typename P::Real sums[kTileNodes * kChannels];
};

template <class P, class Fx>
class TilePass {
  using Real = typename P::Real;
  using T = typename P::RealPack;
  static constexpr int kLanes = P::kLanes;

 public:
  BRECCIA_HD TilePass(const PassArguments<P>& arguments, const Fx& effects, TileScratch<P>& scratch)
      : a_(arguments), fx_(effects), scratch_(scratch) {}

  BRECCIA_HD void run(std::uint32_t index, TileReport& report) {
    const Tile& tile = a_.tiles[index];
    if (a_.gather) load_tile<P>(tile, a_.boxes[index], a_.velocities, scratch_.velocities);
    if (a_.scatter) clear_tile<P>(a_.gather ? a_.boxes[index] : kWholeTile, scratch_.sums);
    const int packs = (static_cast<int>(tile.particles) + kLanes - 1) / kLanes;
    for (int p = 0; p < packs; ++p) {
      const int left = static_cast<int>(tile.particles) - p * kLanes;
      run_pack(tile.first_pack + static_cast<std::size_t>(p), left < kLanes ? left : kLanes, report);
    }
    if (a_.scatter) {
      a_.boxes[index] = touched_.box();
      if (add_tile<P>(tile, a_.boxes[index], scratch_.sums, a_.sums)) ++report.strayed;
    }
  }

 private:
  BRECCIA_HD void run_pack(std::size_t i, int lanes, TileReport& report) {
    Kinematics<P> k = a_.kinematics[i];
    auto state = load_state(a_, fx_, i);
    Mat3<T> gradient;
    if (a_.gather) {
      stencil_.set(k);
      const GridVelocity<P> grid = gather_velocity(lanes);
      gradient = grid.gradient;
      const Real moved = horizontal_max(advance(a_, k, grid));
      if (moved > report.largest_move) report.largest_move = moved;
      for_each_material(i, state, [&](const material::Constants<Real>& c, material::State<T>& s) BRECCIA_INLINE_LAMBDA {
        material::update_strain(fx_, c, s, gradient, a_.step);
        if (fx_.damage) grow_damage(a_, i, k.mass, c, s);
      });
      a_.kinematics[i] = k;
      if (!a_.scatter) store_gradient(i, gradient);
    } else {
      gradient = load_gradient(i);
    }
    if (a_.scatter) {
      const auto place = stencil_.set(k);
      if (any(Stencil<P>::outside(place))) ++report.strayed;
      touched_.add(place, k.mass);
      material::Dissipation<T> lost{};
      Sym3<T> tau{};
      for_each_material(i, state, [&](const material::Constants<Real>& c, material::State<T>& s) BRECCIA_INLINE_LAMBDA {
        stress(c, s, gradient, i, lost, tau);
      });
      const T volume = reference_volume(i, k.mass);
      report.plastic_work += static_cast<double>(horizontal_sum(volume * lost.plastic));
      report.viscous_work += static_cast<double>(horizontal_sum(volume * lost.viscous));
      spread(i, lanes, k, gradient, volume, tau);
    }
    store_state(a_, fx_, i, state);
  }

  BRECCIA_HD GridVelocity<P> gather_velocity(int lanes) {
    const GatheredVelocity<P> g = gather<P>(scratch_.velocities, stencil_, lanes);
    const T c(Real(4) / a_.cell);  // (4 / dx^2) * dx, moments being in cells
    return {{g.value[0], g.value[1], g.value[2]},
            {g.value[3], g.value[4], g.value[5]},
            {c * g.by_x[0], c * g.by_y[0], c * g.by_z[0], c * g.by_x[1], c * g.by_y[1], c * g.by_z[1], c * g.by_x[2],
             c * g.by_y[2], c * g.by_z[2]}};
  }

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

  // The momentum and force polynomials of each lane: value + gradient * (x_i - x_p).
  BRECCIA_HD void spread(std::size_t i, int lanes, const Kinematics<P>& k, const Mat3<T>& c, T volume,
                         const Sym3<T>& tau) {
    const T affine = a_.transfer.affine ? k.mass * T(a_.cell) : T(Real(0));
    const T pull = T(Real(-4) / a_.cell) * volume;
    Vec3<T> g{T(a_.uniform_gravity.x), T(a_.uniform_gravity.y), T(a_.uniform_gravity.z)};
    if (a_.gravity != nullptr) {
      const T* held = a_.gravity[i].acceleration;
      g = g + Vec3<T>{held[0], held[1], held[2]};
    }
    const SpreadMomentum<P> q = {
        {k.mass * k.velocity[0], k.mass * k.velocity[1], k.mass * k.velocity[2], k.mass * g.x, k.mass * g.y,
         k.mass * g.z, k.mass},
        {affine * c.xx, affine * c.yx, affine * c.zx, pull * tau.xx, pull * tau.xy, pull * tau.xz},
        {affine * c.xy, affine * c.yy, affine * c.zy, pull * tau.xy, pull * tau.yy, pull * tau.yz},
        {affine * c.xz, affine * c.yz, affine * c.zz, pull * tau.xz, pull * tau.yz, pull * tau.zz}};
    scatter<P>(scratch_.sums, stencil_, lanes, q);
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
  TileScratch<P>& scratch_;
  Stencil<P> stencil_;
  BoxOfStencils<P> touched_;
};

}  // namespace breccia::grid

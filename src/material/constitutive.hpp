// The constitutive update of one particle (or pack): stress and return mapping before the transfer to the grid, strain
// after it (paper, appendices on stress and plasticity; physics.md 4 "recommended single form" and 5).
#pragma once

#include <cmath>

#include "breccia/linalg.hpp"
#include "breccia/material_parameters.hpp"
#include "breccia/math.hpp"
#include "material/damage.hpp"
#include "material/deformation.hpp"
#include "material/effects_policy.hpp"
#include "material/hencky.hpp"
#include "material/state.hpp"
#include "material/strength.hpp"
#include "material/tillotson.hpp"
#include "material/viscosity.hpp"

namespace breccia::material {

/// Fully damaged, cold and expanded beyond this (ln J = 0.2): a lone particle whose J means nothing has no pressure.
inline constexpr double kLooseVolumeChange = 0.22140275816016985;
inline constexpr double kLooseEnergy = 1.0e6;  ///< [J/kg]

/// Everything the update needs of a material, in the working precision.
template <class R>
struct Constants {
  TillotsonConstants<R> eos;
  StrengthConstants<R> strength;
  ViscosityConstants<R> viscosity;
  R shear_modulus;          ///< mu [Pa]
  R inverse_density;        ///< 1 / rho0 [m3/kg]
  R shear_speed_squared;    ///< 4/3 mu / rho0 [m2/s2]
  R sound_speed_floor;      ///< A / rho0 [m2/s2], least bulk speed squared of the time step
  R volume_change_max;      ///< J_max - 1
  R crack_growth;           ///< c_g (4 pi rho0 / 3)^(1/3): over cbrt(mass [kg]) it is c_g / R_s [1/s]
  bool viscosity_in_yield;  ///< q counts in the pressure of the yield strength
};

/// `cell` is the grid spacing [m].
template <class R>
Constants<R> make_constants(const MaterialParameters& p, const LiteralSwitches& literal, double cell) {
  return {make_tillotson_constants<R>(p.eos),
          make_strength_constants<R>(p, literal),
          make_viscosity_constants<R>(p, cell),
          R(p.shear_modulus),
          R(1.0 / p.eos.rho0),
          R(4.0 / 3.0 * p.shear_modulus / p.eos.rho0),
          R(p.eos.A / p.eos.rho0),
          R(literal.volume_ratio_max - 1.0),
          R(crack_growth_rate(p, 1.0 / p.eos.rho0)),
          literal.viscosity_in_yield};
}

namespace detail {

/// D of the particle; 0 where no damage field is kept.
template <class Fx, class T>
BRECCIA_HD T damage_of(Fx fx, const State<T>& state) {
  using R = scalar_of<T>;
  if (fx.fully_damaged) return T(R(1));
  if (fx.damage || fx.strength) return state.damage_root * state.damage_root * state.damage_root;
  return T(R(0));
}

template <class Fx, class T>
BRECCIA_HD T energy_of(Fx fx, const State<T>& state) {
  using R = scalar_of<T>;
  if (fx.energy) return max(state.energy.value(), T(R(0)));
  return T(R(0));
}

/// tau : d for tau = s - J P I and d the symmetric part of the velocity gradient [W/m3].
template <class T>
BRECCIA_HD T stress_power(const Dev3<T>& s, T kirchhoff_pressure, const Mat3<T>& l) {
  return s.xx * (l.xx - l.zz) + s.yy * (l.yy - l.zz) + s.xy * (l.xy + l.yx) + s.xz * (l.xz + l.zx) +
         s.yz * (l.yz + l.zy) - kirchhoff_pressure * trace(l);
}

/// J P without viscosity, and J q [Pa].
template <class T>
struct TrialPressure {
  T thermodynamic;
  T viscous;
};

template <class Fx, class R, class T>
BRECCIA_HD TrialPressure<T> trial_pressure(Fx fx, const Constants<R>& k, const State<T>& state, T energy, T damage,
                                           const Mat3<T>& velocity_gradient) {
  const T zero(R(0));
  const T j = state.volume.value();
  const T p = tillotson_pressure(k.eos, j, energy);
  TrialPressure<T> trial{p + j * p, zero};
  if (fx.viscosity) trial.viscous = viscous_kirchhoff_pressure(k.viscosity, trace(velocity_gradient));
  if (fx.fully_damaged || fx.damage || fx.strength) {
    const auto loose = (damage >= T(R(1))) & (j > T(R(kLooseVolumeChange))) & (energy < T(R(kLooseEnergy)));
    trial.thermodynamic = select(loose, zero, trial.thermodynamic);
    trial.viscous = select(loose, zero, trial.viscous);
  }
  return trial;
}

/// Tension carried by the undamaged part only.
template <class T>
BRECCIA_HD T reduce_tension(T kirchhoff_pressure, T damage) {
  using R = scalar_of<T>;
  return select(kirchhoff_pressure < T(R(0)), kirchhoff_pressure - damage * kirchhoff_pressure, kirchhoff_pressure);
}

/// What of J q is left of it in reduce_tension(P + q) - reduce_tension(P): damage takes its share of what only relieves
/// tension.
template <class T>
BRECCIA_HD T reduced_viscous(const TrialPressure<T>& trial, T damage) {
  using R = scalar_of<T>;
  return trial.viscous - damage * min(trial.viscous, max(-trial.thermodynamic, T(R(0))));
}

}  // namespace detail

/// Steps 1 and 2 of physics.md 4 and step 1 of 5, at time n. Reads the trial elastic strain, J, e and D; stores the
/// returned elastic strain and J P; adds the second half of the stress work of the step before,
/// half_step * tau^n : d^{n-1/2} / rho0, to the energy [J/kg]; sets `dissipation`, which refers to the whole step.
/// `velocity_gradient` is C^{n-1/2} [1/s], `half_step` dt/2 [s]. Returns the Kirchhoff stress tau^n [Pa].
template <class Fx, class R, class T>
BRECCIA_HD Sym3<T> update_stress(Fx fx, const Constants<R>& k, State<T>& state, const Mat3<T>& velocity_gradient,
                                 scalar_of<T> half_step, Dissipation<T>& dissipation) {
  const T zero(R(0)), one(R(1));
  const T energy = detail::energy_of(fx, state);
  const T damage = detail::damage_of(fx, state);
  const detail::TrialPressure<T> trial = detail::trial_pressure(fx, k, state, energy, damage, velocity_gradient);
  T pressure = detail::reduce_tension(trial.thermodynamic + trial.viscous, damage);
  dissipation.plastic = zero;
  T viscous = detail::reduced_viscous(trial, damage);

  Dev3<T> s{zero, zero, zero, zero, zero};
  if (fx.shear) {
    const TracelessPowers<T> powers = traceless_powers(state.elastic);
    const Dev3<T> twice_hencky = deviatoric_log(state.elastic, powers);
    s = k.shear_modulus * twice_hencky;
    if (fx.strength) {
      const T melt = melt_factor(k.strength, energy);
      const T outside = k.viscosity_in_yield ? zero : trial.viscous;
      const T confining = k.viscosity_in_yield ? pressure : detail::reduce_tension(trial.thermodynamic, damage);
      const T yield = yield_strain(k.strength, confining, damage, melt);
      const T hencky_square = T(R(0.25)) * squared_norm(twice_hencky);
      const auto beyond_apex = yield <= zero;
      if (any((hencky_square > yield * yield) | beyond_apex)) {
        const T hencky_norm = sqrt(hencky_square);
        const T ratio = min(max(yield, zero) / max(hencky_norm, T(R(1.0e-30))), one);
        const T apex = apex_pressure(k.strength, damage, melt) + outside;
        pressure = select(beyond_apex, apex, pressure);
        viscous = select(beyond_apex, outside, viscous);
        const T shrink = select(beyond_apex, zero, ratio);
        state.elastic = traceless_power(state.elastic, powers, shrink);
        s = shrink * s;
        dissipation.plastic = T(R(2)) * k.shear_modulus * shrink * (one - shrink) * hencky_norm * hencky_norm;
      }
    }
  }
  dissipation.viscous = T(R(-2)) * half_step * viscous * trace(velocity_gradient);
  state.kirchhoff_pressure = pressure;
  if (fx.energy)
    state.energy.add((half_step * k.inverse_density) * detail::stress_power(s, pressure, velocity_gradient));
  return {s.xx - pressure, s.yy - pressure, s.zz() - pressure, s.xy, s.xz, s.yz};
}

/// Step 6 of physics.md 5, after the transfer from the grid: adds the first half of the stress work,
/// step/2 * tau^n : d^{n+1/2} / rho0, with tau^n rebuilt from the stored elastic strain and J P, and carries the
/// elastic strain, J and (while damage is on and D < 1) the total strain along with I + A, A = step *
/// velocity_gradient. Returns det(I + A) - 1; below kLeastVolumeIncrement the change of J was cut (hard case 3).
template <class Fx, class R, class T>
BRECCIA_HD T update_strain(Fx fx, const Constants<R>& k, State<T>& state, const Mat3<T>& velocity_gradient,
                           scalar_of<T> step) {
  const T zero(R(0));
  if (fx.energy) {
    Dev3<T> s{zero, zero, zero, zero, zero};
    if (fx.shear) s = k.shear_modulus * deviatoric_log(state.elastic, traceless_powers(state.elastic));
    const T power = detail::stress_power(s, state.kirchhoff_pressure, velocity_gradient);
    state.energy.add((R(0.5) * step * k.inverse_density) * power);
  }
  const Mat3<T> a = scaled(velocity_gradient, T(step));
  if (fx.shear) state.elastic = carry_traceless(a, state.elastic);
  if (fx.damage) {
    // Dropped once D = 1: the strain of a lone expanding particle would grow until it overflows.
    const T kept = select(state.damage_root < T(R(1)), T(R(1)), zero);
    state.total = kept * carry(a, state.total);
  }
  const T increment = volume_increment(a);
  change_volume(state.volume, increment, T(k.volume_change_max));
  return increment;
}

/// Longitudinal wave speed [m/s] for the adaptive time step: sqrt(c^2 + 4/3 mu / rho0), the bulk c^2 of the equation
/// of state floored at A / rho0.
template <class Fx, class R, class T>
BRECCIA_HD T longitudinal_sound_speed(Fx fx, const Constants<R>& k, const State<T>& state) {
  const Compression<T> c = compression_from_volume(state.volume.value());
  const T bulk = tillotson_sound_speed_squared(k.eos, c, detail::energy_of(fx, state));
  const T shear = fx.shear ? T(k.shear_speed_squared) : T(R(0));
  return sqrt(max(bulk, T(k.sound_speed_floor)) + shear);
}

}  // namespace breccia::material

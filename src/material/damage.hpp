// Grady-Kipp growth of tensile damage on Weibull flaws (paper, damage update; physics.md 3).
#pragma once

#include <cmath>

#include "breccia/constants.hpp"
#include "breccia/elementary.hpp"
#include "breccia/material_parameters.hpp"
#include "breccia/math.hpp"
#include "material/eigen.hpp"
#include "material/state.hpp"

namespace breccia::material {

/// Largest principal Hencky strain of the total deformation, 1/2 ln(1 + lambda_max(F F^T - I)); negative if every
/// direction is shortened.
template <class T>
BRECCIA_HD T principal_strain(const State<T>& state) {
  using R = scalar_of<T>;
  return T(R(0.5)) * log1p(largest_eigenvalue(state.total));
}

/// False only where principal_strain does not exceed `threshold`: ln(1 + x) <= x. Rounding must not hide a flaw that is
/// just reached, hence the small share.
template <class T>
BRECCIA_HD auto principal_strain_may_exceed(const State<T>& state, T threshold) {
  using R = scalar_of<T>;
  return eigenvalue_may_exceed(state.total, T(R(2.0 / 1.0001)) * threshold);
}

/// c_g / R_s [1/s]: crack speed (a fixed share of the longitudinal wave speed) over the radius of the sphere that has
/// the reference volume [m3] of a particle.
inline double crack_growth_rate(const MaterialParameters& p, double particle_volume) {
  const double wave_speed = std::sqrt((p.eos.A + 4.0 / 3.0 * p.shear_modulus) / p.eos.rho0);
  const double radius = std::cbrt(3.0 * particle_volume / (4.0 * kPi));
  return p.damage.crack_speed_ratio * wave_speed / radius;
}

/// D^(1/3) one step later: d(D^(1/3))/dt = n_act c_g / R_s up to D = n_act / n_tot; damage never heals.
/// `growth` is c_g / R_s times the step, `active` and `total` count the flaws of the particle (total >= 1).
template <class T>
BRECCIA_HD T grow_damage_root(T damage_root, T active, T total, T growth) {
  using R = scalar_of<T>;
  const T one(R(1));
  const T grown = damage_root + active * growth;
  const T cap = cbrt(min(active / total, one));
  return min(max(damage_root, min(grown, cap)), one);
}

}  // namespace breccia::material

// Yield strength: Lundborg for intact rock, Drucker-Prager for damaged rock (paper, appendix on plasticity; physics.md
// 4).
#pragma once

#include <cmath>

#include "breccia/material_parameters.hpp"
#include "breccia/math.hpp"

namespace breccia::material {

/// alpha of the yield condition |dev tau| <= 3 J P alpha for a friction angle [rad] and a cone convention.
inline double friction_coefficient(double angle, FrictionCone cone) {
  const double sine = std::sin(angle);
  switch (cone) {
    case FrictionCone::kInner:
      return std::sqrt(2.0 / 3.0) * 2.0 * sine / (3.0 + sine);
    case FrictionCone::kTangent:
      return std::sqrt(2.0) / 3.0 * std::tan(angle);
    case FrictionCone::kOuter:
      break;
  }
  return std::sqrt(2.0 / 3.0) * 2.0 * sine / (3.0 - sine);
}

/// All stresses are Frobenius norms of the deviator, sqrt(2 J2) [Pa].
template <class R>
struct StrengthConstants {
  R cohesion;             ///< sqrt(2) Y0
  R intact_slope;         ///< 3 alpha_c
  R damaged_slope;        ///< 3 alpha_d
  R inverse_range;        ///< 1 / (sqrt(2) (Ym - Y0)) [1/Pa]
  R inverse_melt_energy;  ///< [kg/J]
  R inverse_two_mu;       ///< [1/Pa]
  bool cap_damaged_yield;
  bool linear_tension;
};

template <class R>
StrengthConstants<R> make_strength_constants(const MaterialParameters& p, const LiteralSwitches& literal) {
  const StrengthParameters& s = p.strength;
  const double root2 = std::sqrt(2.0);
  return {R(root2 * s.cohesion),
          R(3.0 * friction_coefficient(s.intact_friction_angle, s.cone)),
          R(3.0 * friction_coefficient(s.damaged_friction_angle, s.cone)),
          R(1.0 / (root2 * (s.limit - s.cohesion))),
          R(1.0 / s.melt_energy),
          R(p.shear_modulus > 0.0 ? 0.5 / p.shear_modulus : 0.0),
          literal.cap_damaged_yield,
          literal.linear_tension};
}

/// Softening 1 - E / E_melt, kept in [0, 1].
template <class T, class R>
BRECCIA_HD T melt_factor(const StrengthConstants<R>& k, T energy) {
  return min(max(T(R(1)) - energy * k.inverse_melt_energy, T(R(0))), T(R(1)));
}

/// Yield strength Y in strain units, the bound of |dev h|; zero or negative beyond the apex. `kirchhoff_pressure` is
/// J P [Pa] (J in both places of the Lundborg form), `damage` is D, `melt` the melt_factor.
template <class T, class R>
BRECCIA_HD T yield_strain(const StrengthConstants<R>& k, T kirchhoff_pressure, T damage, T melt) {
  const T one(R(1));
  const T friction = k.intact_slope * kirchhoff_pressure;
  // Without its denominator in tension the hyperbola has no pole.
  const T compressive = k.linear_tension ? max(friction, T(R(0))) : friction;
  const T denominator = one + compressive * k.inverse_range;
  const T safe = select(denominator == T(R(0)), T(R(1.0e-6)), denominator);
  const T intact = melt * (k.cohesion + friction * reciprocal(safe));
  const T cone = k.damaged_slope * kirchhoff_pressure;
  const T damaged = k.cap_damaged_yield ? min(cone, intact) : cone;
  return (intact + damage * (damaged - intact)) * k.inverse_two_mu;
}

/// J P [Pa] at which Y = 0 (at most 0): the pressure that replaces the trial one beyond the apex (physics.md 4).
template <class T, class R>
BRECCIA_HD T apex_pressure(const StrengthConstants<R>& k, T damage, T melt) {
  const T zero(R(0)), smallest(R(1.0e-20));
  const T c = (T(R(1)) - damage) * melt;
  const T d = damage * k.damaged_slope;
  if (k.linear_tension) return -c * k.cohesion / max(c * k.intact_slope + d, smallest);
  // Root nearest 0 of (d a / m) x^2 + (c a (1 + y0/m) + d) x + c y0 = 0, in the form without cancellation.
  const T quadratic = d * (k.intact_slope * k.inverse_range);
  const T linear = c * (k.intact_slope * (R(1) + k.cohesion * k.inverse_range)) + d;
  const T constant = c * k.cohesion;
  const T root = sqrt(max(linear * linear - T(R(4)) * quadratic * constant, zero));
  return T(R(-2)) * constant / max(linear + root, smallest);
}

}  // namespace breccia::material

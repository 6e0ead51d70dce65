// Tillotson equation of state (physics.md 2): pressure and its derivatives, every branch, one source for all scalars.
#pragma once

#include "breccia/elementary.hpp"
#include "breccia/material_parameters.hpp"
#include "breccia/math.hpp"

namespace breccia::material {

/// The parameters in the working precision, with the reciprocals the hot path needs.
template <class R>
struct TillotsonConstants {
  R rho0, inverse_rho0;  ///< [kg/m3], [m3/kg]
  R a, b, A, B;
  R inverse_E0;     ///< [kg/J]
  R Eiv;            ///< [J/kg]
  R inverse_range;  ///< 1 / (Ecv - Eiv) [kg/J]
  R alpha, beta;
};

template <class R>
TillotsonConstants<R> make_tillotson_constants(const TillotsonParameters& p) {
  return {R(p.rho0), R(1.0 / p.rho0),          R(p.a),     R(p.b),   R(p.A), R(p.B), R(1.0 / p.E0),
          R(p.Eiv),  R(1.0 / (p.Ecv - p.Eiv)), R(p.alpha), R(p.beta)};
}

/// Density in the three forms the equation of state uses, each free of cancellation.
template <class T>
struct Compression {
  T eta;  ///< rho / rho0
  T mu;   ///< eta - 1
  T nu;   ///< 1 / eta - 1
};

/// Least eta at which the equation of state is evaluated (physics.md 2, guard 2).
inline constexpr double kLeastEta = 1.0e-4;

/// From the volume change j = J - 1.
template <class T>
BRECCIA_HD Compression<T> compression_from_volume(T volume_change) {
  using R = scalar_of<T>;
  const T nu = min(volume_change, T(R(1.0 / kLeastEta - 1.0)));
  const T eta = reciprocal(T(R(1)) + nu);
  return {eta, -nu * eta, nu};
}

/// Pressure and its partial derivatives at one state.
template <class T>
struct TillotsonPoint {
  T pressure;    ///< [Pa]
  T by_density;  ///< dP/drho at constant E [m2/s2]
  T by_energy;   ///< dP/dE at constant rho [kg/m3]
};

/// physics.md 2, all branches. Negative specific energies [J/kg] count as 0 (guard 3). Unused members cost nothing.
template <class T, class R>
BRECCIA_HD TillotsonPoint<T> tillotson(const TillotsonConstants<R>& k, const Compression<T>& c, T energy) {
  const T one(R(1)), two(R(2)), three(R(3));
  const T E = max(energy, T(R(0)));
  const T J = one + c.nu;
  const T inverse_w = reciprocal(one + E * k.inverse_E0 * (J * J));
  const T rho = k.rho0 * c.eta;
  const T thermal = k.b * rho * E * inverse_w;
  const T thermal_by_density = k.b * E * inverse_w * (three - two * inverse_w);

  TillotsonPoint<T> p;
  p.pressure = k.a * rho * E + thermal + c.mu * (k.A + k.B * c.mu);
  p.by_density = k.a * E + thermal_by_density + (k.A + two * k.B * c.mu) * k.inverse_rho0;
  p.by_energy = rho * (k.a + k.b * inverse_w * inverse_w);

  const auto vapour = (c.nu > T(R(0))) & (E > T(k.Eiv));
  if (any(vapour)) [[unlikely]] {
    const T volume_factor = exp(-k.alpha * c.nu * c.nu);
    const T elastic_factor = exp(-k.beta * c.nu);
    const T nu_by_density = -J * J * k.inverse_rho0;
    const T bracket = thermal + k.A * c.mu * elastic_factor;
    const T bracket_by_density =
        thermal_by_density + k.A * elastic_factor * (k.inverse_rho0 - k.beta * c.mu * nu_by_density);
    const T hot = k.a * rho * E + volume_factor * bracket;
    const T hot_by_density =
        k.a * E + volume_factor * (bracket_by_density - two * k.alpha * c.nu * nu_by_density * bracket);
    const T hot_by_energy = rho * (k.a + k.b * volume_factor * inverse_w * inverse_w);

    const T weight = min((E - k.Eiv) * k.inverse_range, one);
    const T weight_by_energy = select(weight < one, T(k.inverse_range), T(R(0)));
    p.by_energy =
        select(vapour, p.by_energy + weight * (hot_by_energy - p.by_energy) + weight_by_energy * (hot - p.pressure),
               p.by_energy);
    p.by_density = select(vapour, p.by_density + weight * (hot_by_density - p.by_density), p.by_density);
    p.pressure = select(vapour, p.pressure + weight * (hot - p.pressure), p.pressure);
  }
  return p;
}

/// Pressure [Pa] from the volume change j = J - 1 and the specific energy [J/kg].
template <class T, class R>
BRECCIA_HD T tillotson_pressure(const TillotsonConstants<R>& k, T volume_change, T energy) {
  return tillotson(k, compression_from_volume(volume_change), energy).pressure;
}

/// Bulk sound speed squared dP/drho + P/rho^2 dP/dE [m2/s2], not floored: negative where the cold curve is unstable.
template <class T, class R>
BRECCIA_HD T tillotson_sound_speed_squared(const TillotsonConstants<R>& k, const Compression<T>& c, T energy) {
  const TillotsonPoint<T> p = tillotson(k, c, energy);
  const T inverse_rho = (T(R(1)) + c.nu) * k.inverse_rho0;
  return p.by_density + p.pressure * inverse_rho * inverse_rho * p.by_energy;
}

}  // namespace breccia::material

// Wilkins artificial viscosity (paper, appendix on artificial viscosity; physics.md 5).
#pragma once

#include <cmath>

#include "breccia/material_parameters.hpp"
#include "breccia/math.hpp"

namespace breccia::material {

template <class R>
struct ViscosityConstants {
  R linear;     ///< rho0 A1 c0 dx [Pa s]
  R quadratic;  ///< rho0 A2 dx^2 [Pa s2]
};

template <class R>
ViscosityConstants<R> make_viscosity_constants(const MaterialParameters& p, double cell) {
  const double c0 = std::sqrt(p.eos.A / p.eos.rho0);
  return {R(p.eos.rho0 * p.viscosity_linear * c0 * cell), R(p.eos.rho0 * p.viscosity_quadratic * cell * cell)};
}

/// J q [Pa], the viscous pressure times the volume ratio: rho = rho0 / J makes it independent of J. Zero in expansion.
template <class T, class R>
BRECCIA_HD T viscous_kirchhoff_pressure(const ViscosityConstants<R>& k, T velocity_divergence) {
  const T closing = max(-velocity_divergence, T(R(0)));
  return closing * (k.linear + k.quadratic * closing);
}

}  // namespace breccia::material

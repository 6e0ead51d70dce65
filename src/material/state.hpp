// The per-particle material state in registers, as the constitutive functions read and write it.
// T is float, double or a Pack. Nothing here knows how particles lie in memory (grid/particles.hpp does).
#pragma once

#include "breccia/linalg.hpp"
#include "breccia/math.hpp"

namespace breccia::material {

/// State between two calls of the constitutive update. Fields of an effect that is off are neither read nor written.
template <class T>
struct State {
  Dev3<T> elastic;        ///< E = b_e / (tr b_e / 3) - I, traceless (shear); cpu_limit.md 1
  Accumulator<T> volume;  ///< J - 1
  Accumulator<T> energy;  ///< specific internal energy [J/kg] (energy)
  T kirchhoff_pressure;   ///< J P after damage and apex [Pa]: rebuilds tau of the last stress call
  T damage_root;          ///< D^(1/3) (damage or strength)
  Sym3<T> total;          ///< T = F F^T - I of the total deformation (damage; 0 once D = 1)
};

/// What one stress call adds to the energy budget, per unit reference volume [J/m3].
template <class T>
struct Dissipation {
  T plastic;  ///< tau : d_plastic dt of the return mapping
  T viscous;  ///< -J q tr(d) dt, of J q what the stress has in it after damage and apex
};

}  // namespace breccia::material

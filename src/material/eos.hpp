// One state of the Tillotson equation of state in double precision, for the `eos` command and for checks.
#pragma once

#include "breccia/material_parameters.hpp"

namespace breccia::material {

/// Branch of the equation of state (physics.md 2).
enum class EosBranch { kCompressed, kCold, kMixed, kHot };

/// "comp", "cold", "mix" or "hot".
const char* eos_branch_name(EosBranch branch);

struct EosPoint {
  double pressure = 0.0;             ///< [Pa]
  double sound_speed_squared = 0.0;  ///< dP/drho + P/rho^2 dP/dE, not floored [m2/s2]
  double sound_speed = 0.0;          ///< of the time step: floored at sqrt(A / rho0) [m/s]
  EosBranch branch = EosBranch::kCompressed;
};

/// `density` [kg/m3] > 0, `energy` specific [J/kg]. The guards of the simulation hold here too: a negative energy
/// counts as 0 and a density below 1e-4 rho0 as 1e-4 rho0. Throws UsageError where density is not positive or a number
/// is not finite.
EosPoint evaluate_eos(const TillotsonParameters& parameters, double density, double energy);

}  // namespace breccia::material

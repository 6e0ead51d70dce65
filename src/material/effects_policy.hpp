// Which parts of the material model a kernel computes. A policy is any type with the members below, convertible to
// bool: compile-time constants specialise the kernel, plain bools (RuntimeEffects) serve every other combination.
#pragma once

namespace breccia::material {

/// Everything on: intact to damaged rock.
struct RockEffects {
  static constexpr bool shear = true;           ///< deviatoric stress 2 mu h
  static constexpr bool strength = true;        ///< yield and return mapping
  static constexpr bool damage = true;          ///< total strain kept for flaw growth
  static constexpr bool viscosity = true;       ///< Wilkins q
  static constexpr bool energy = true;          ///< e integrated, enters the equation of state
  static constexpr bool fully_damaged = false;  ///< D = 1 everywhere, no damage field
};

/// Cohesionless debris: D = 1 everywhere and nothing left to damage.
struct GranularEffects : RockEffects {
  static constexpr bool damage = false;
  static constexpr bool fully_damaged = true;
};

/// Elastic without limit.
struct ElasticEffects : RockEffects {
  static constexpr bool strength = false;
  static constexpr bool damage = false;
};

/// Pressure only.
struct FluidEffects : ElasticEffects {
  static constexpr bool shear = false;
};

/// Any combination, decided at run time; the same for every particle of a call.
struct RuntimeEffects {
  bool shear = true;
  bool strength = true;
  bool damage = true;
  bool viscosity = true;
  bool energy = true;
  bool fully_damaged = false;
};

}  // namespace breccia::material

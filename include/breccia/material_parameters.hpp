// Parameters of one material, SI, double. The default is the basalt of physics.md section 1.
#pragma once

#include <string>

namespace breccia {

/// Tillotson equation of state (physics.md 2).
struct TillotsonParameters {
  double rho0 = 2700.0;  ///< reference density [kg/m3]
  double a = 0.5;
  double b = 1.5;
  double A = 2.67e10;   ///< bulk modulus [Pa]
  double B = 2.67e10;   ///< [Pa]
  double E0 = 4.87e8;   ///< [J/kg]
  double Eiv = 4.72e6;  ///< incipient vaporisation [J/kg]
  double Ecv = 1.82e7;  ///< complete vaporisation [J/kg]
  double alpha = 5.0;
  double beta = 5.0;
};

/// How a friction angle becomes the slope sqrt(J2)/P (physics.md 4).
enum class FrictionCone { kOuter, kInner, kTangent };

/// Lundborg strength of intact rock, Drucker-Prager strength of damaged rock (physics.md 4).
struct StrengthParameters {
  double cohesion = 1.0e8;                            ///< Y0, shear strength at P = 0 [Pa]
  double limit = 3.5e9;                               ///< Ym, shear strength at P -> infinity [Pa]
  double intact_friction_angle = 0.982793723247329;   ///< phi_c = atan(1.5) [rad]
  double damaged_friction_angle = 0.698131700797732;  ///< phi_d = 40 deg [rad]
  FrictionCone cone = FrictionCone::kOuter;
  double melt_energy = 3.4e6;  ///< E_melt [J/kg]
};

/// Grady-Kipp damage with Weibull flaws (physics.md 3).
struct DamageParameters {
  double weibull_k = 4.0e35;  ///< [1/m3]
  double weibull_m = 9.0;
  double crack_speed_ratio = 0.4;  ///< c_g over the longitudinal wave speed
};

struct MaterialParameters {
  std::string name = "basalt";
  TillotsonParameters eos;
  double shear_modulus = 2.27e10;  ///< mu [Pa]
  StrengthParameters strength;
  DamageParameters damage;
  double viscosity_linear = 1.0;     ///< A1 of the artificial viscosity
  double viscosity_quadratic = 2.0;  ///< A2
};

/// Switches that reproduce the paper where our defaults differ (physics.md 4 and 9).
struct LiteralSwitches {
  bool cap_damaged_yield = true;    ///< Y_d <= Y_c
  bool linear_tension = true;       ///< Lundborg without its denominator for P < 0 (no pole)
  bool viscosity_in_yield = true;   ///< q counts in the pressure of the yield strength
  double volume_ratio_max = 1.0e3;  ///< J_max: J of a lone expanding particle is clamped here
};

}  // namespace breccia

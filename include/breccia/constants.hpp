// Physical constants, SI.
#pragma once

namespace breccia {

inline constexpr double kPi = 3.14159265358979323846;
/// Newtonian constant of gravitation, CODATA 2018 [m3 kg-1 s-2].
inline constexpr double kGravitationalConstant = 6.67430e-11;

}  // namespace breccia

// Quantities as people write them ("50 km", "2.7 g/cm3", "4e35 1/m3") to SI numbers, with their dimension checked.
#pragma once

#include <string>
#include <string_view>

namespace breccia::scene {

/// Exponents of length, mass, time and angle. Angle is counted as a dimension of its own so that a rotation rate given
/// as a frequency (1/s), which is ambiguous by 2 pi, is refused.
struct Dimension {
  int length = 0;
  int mass = 0;
  int time = 0;
  int angle = 0;
  friend bool operator==(const Dimension&, const Dimension&) = default;
};

inline constexpr Dimension kPure{};
inline constexpr Dimension kLength{1, 0, 0, 0};
inline constexpr Dimension kMass{0, 1, 0, 0};
inline constexpr Dimension kTime{0, 0, 1, 0};
inline constexpr Dimension kAngle{0, 0, 0, 1};
inline constexpr Dimension kVelocity{1, 0, -1, 0};
inline constexpr Dimension kAngularVelocity{0, 0, -1, 1};
inline constexpr Dimension kAcceleration{1, 0, -2, 0};
inline constexpr Dimension kDensity{-3, 1, 0, 0};
inline constexpr Dimension kPressure{-1, 1, -2, 0};
inline constexpr Dimension kSpecificEnergy{2, 0, -2, 0};
inline constexpr Dimension kNumberDensity{-3, 0, 0, 0};

/// A number in SI (angles in rad) and what it measures.
struct Quantity {
  double value = 0.0;
  Dimension dimension;
};

/// Reads NUMBER [UNIT]. A unit is a product of symbols with optional SI prefix and integer power: "m/s2", "m s^-2",
/// "J/(kg)", "1/m3". "/" divides by the next factor only. Throws UsageError (without place) if the text is not a
/// quantity, the unit is unknown or the number is not finite.
Quantity parse_quantity(std::string_view text);

/// The SI value of `text` measured in `expected`. Zero needs no unit. Throws UsageError (without place) that names the
/// unit to add or the dimension to use.
double parse_quantity(std::string_view text, Dimension expected);

/// What a dimension is called, with article: "a length".
std::string dimension_name(Dimension dimension);

/// The unit a dimension is printed in: "m", "kg/m3", "deg"; empty for pure numbers.
std::string_view display_unit(Dimension dimension);

/// A quantity as it would be written: "125 m", "15 deg", "0.995".
std::string format_quantity(double value, Dimension dimension);

}  // namespace breccia::scene

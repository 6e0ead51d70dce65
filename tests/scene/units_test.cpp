// Quantities as people write them. Expected values are exact products of powers of ten unless stated.
#include "scene/units.hpp"

#include <gtest/gtest.h>

#include <string>

#include "breccia/constants.hpp"
#include "breccia/error.hpp"

namespace breccia::scene {
namespace {

std::string error_of(const std::string& text, Dimension dimension) {
  try {
    parse_quantity(text, dimension);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

void expect_si(const std::string& text, Dimension dimension, double value) {
  // Two roundings at most: number times factor, and the power of a prefixed unit.
  EXPECT_NEAR(parse_quantity(text, dimension), value, 1e-15 * std::abs(value)) << text;
}

TEST(Units, ReadsWhatPeopleWrite) {
  expect_si("50 km", kLength, 5.0e4);
  expect_si("50km", kLength, 5.0e4);
  expect_si("  +50 km ", kLength, 5.0e4);
  expect_si("200 m/s", kVelocity, 200.0);
  expect_si("1.1e-4 rad/s", kAngularVelocity, 1.1e-4);
  expect_si("15 deg", kAngle, 15.0 * kPi / 180.0);
  expect_si("2.5 h", kTime, 9000.0);
  expect_si("1e5 s", kTime, 1.0e5);
  expect_si("10 min", kTime, 600.0);
  expect_si("4e35 1/m3", kNumberDensity, 4.0e35);
  expect_si("4e29 cm^-3", kNumberDensity, 4.0e35);
  expect_si("26.7 GPa", kPressure, 2.67e10);
  expect_si("2700 kg/m3", kDensity, 2700.0);
  expect_si("2.7 g/cm3", kDensity, 2700.0);
  expect_si("487 MJ/kg", kSpecificEnergy, 4.87e8);
  expect_si("-9.81 m/s^2", kAcceleration, -9.81);
  expect_si("1 rev/h", kAngularVelocity, 2.0 * kPi / 3600.0);
  expect_si("5 µm", kLength, 5.0e-6);
  expect_si("0.995", kPure, 0.995);
}

TEST(Units, CompoundUnitsMultiplyDivideAndTakePowers) {
  expect_si("3 kg m2 s^-2 / kg", kSpecificEnergy, 3.0);
  expect_si("3 kg*m2/(kg s2)", kSpecificEnergy, 3.0);
  expect_si("3 m s-2", kAcceleration, 3.0);
  expect_si("3 erg/g", kSpecificEnergy, 3.0e-4);
  expect_si("3 dyn/cm2", kPressure, 0.3);
  // "/" divides by the next factor only, as in the SI rules.
  EXPECT_EQ(parse_quantity("1 m/s s").dimension, kLength);
}

// Prefixes and powers of ten are applied in one correctly rounded step.
TEST(Units, DecimalUnitsAreExact) {
  EXPECT_EQ(parse_quantity("2.5 g/cm3", kDensity), 2500.0);
  EXPECT_EQ(parse_quantity("26.7 GPa", kPressure), 2.67e10);
  EXPECT_EQ(parse_quantity("4e29 1/cm3", kNumberDensity), 4.0e35);
  EXPECT_EQ(parse_quantity("3 mm", kLength), 0.003);
  EXPECT_EQ(parse_quantity("4.72e10 erg/g", kSpecificEnergy), 4.72e6);
}

TEST(Units, UnitsWithoutPrefixWin) {
  EXPECT_DOUBLE_EQ(parse_quantity("1 min").value, 60.0);
  EXPECT_DOUBLE_EQ(parse_quantity("1 h").value, 3600.0);
  EXPECT_EQ(parse_quantity("1 Pa").dimension, kPressure);
  EXPECT_DOUBLE_EQ(parse_quantity("1 mm").value, 1.0e-3);
  EXPECT_DOUBLE_EQ(parse_quantity("1 ms").value, 1.0e-3);
}

TEST(Units, ZeroNeedsNoUnitButOtherNumbersDo) {
  EXPECT_EQ(parse_quantity("0", kLength), 0.0);
  EXPECT_EQ(parse_quantity("0.0", kAngularVelocity), 0.0);
  EXPECT_EQ(error_of("2500", kLength), "\"2500\" needs a unit: a length, for example \"2.5 km\"");
  EXPECT_NE(error_of("0 s", kLength), "");
}

TEST(Units, WrongDimensionsSayWhatIsWanted) {
  EXPECT_EQ(error_of("5 kg", kLength), "\"5 kg\" is a mass; what is wanted is a length, for example 2.5 km");
  // A frequency is not a rotation rate: they differ by 2 pi.
  EXPECT_NE(error_of("1e-4 1/s", kAngularVelocity), "");
  EXPECT_NE(error_of("1e-4 Hz", kAngularVelocity), "");
  EXPECT_NE(error_of("5 m/m", kLength), "");
  EXPECT_NE(error_of("5 kg m", kLength).find("kg m"), std::string::npos);
}

TEST(Units, NonsenseIsRefused) {
  for (const char* text : {"", "km", "nan", "inf m", "1e999 m", "1e300 Tm", "5 furlong", "5 m^", "5 m/", "5 (m", "5 m)",
                           "5 m^99", "5 m/s/", "5,0 m", "1 2 m", "5 kkm"})
    EXPECT_NE(error_of(text, kLength), "") << text;
  EXPECT_EQ(error_of("5 furlong", kLength), "\"5 furlong\": unknown unit \"furlong\"");
}

TEST(Units, PrintedQuantitiesReadBack) {
  for (const double x : {0.1220703125, 2.67e10, 1.0 / 3.0, -1e-300}) {
    EXPECT_EQ(parse_quantity(format_quantity(x, kPressure), kPressure), x);
  }
  EXPECT_EQ(format_quantity(15.0 * kPi / 180.0, kAngle), "15 deg");
  EXPECT_EQ(format_quantity(125.0, kLength), "125 m");
  EXPECT_EQ(format_quantity(-2500.0, kLength), "-2.5 km");
  EXPECT_EQ(format_quantity(2.67e10, kPressure), "26.7 GPa");
  EXPECT_EQ(format_quantity(0.995, kPure), "0.995");
}

}  // namespace
}  // namespace breccia::scene

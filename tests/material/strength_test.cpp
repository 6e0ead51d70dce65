// Yield strength: slopes, apex, cap, softening and the literal switches (physics.md 4).
#include "material/strength.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using namespace breccia::material;
using breccia::FrictionCone;
using breccia::LiteralSwitches;
using breccia::MaterialParameters;

StrengthConstants<double> constants(const LiteralSwitches& literal = {}) {
  return make_strength_constants<double>(MaterialParameters{}, literal);
}
/// Y in Pa as sqrt(J2) = |s| / sqrt(2).
double shear_strength(const StrengthConstants<double>& k, double pressure, double damage, double melt = 1.0) {
  return yield_strain(k, pressure, damage, melt) / k.inverse_two_mu / std::sqrt(2.0);
}

TEST(Strength, FrictionSlopesOfTheThreeCones) {
  const breccia::StrengthParameters s;
  const auto slope = [](double angle, FrictionCone cone) {
    return 3.0 * friction_coefficient(angle, cone) / std::sqrt(2.0);
  };
  EXPECT_NEAR(slope(s.damaged_friction_angle, FrictionCone::kOuter), 0.944625, 1e-6);
  EXPECT_NEAR(slope(s.damaged_friction_angle, FrictionCone::kInner), 0.611258, 1e-6);
  EXPECT_NEAR(slope(s.damaged_friction_angle, FrictionCone::kTangent), 0.839100, 1e-6);
  EXPECT_NEAR(slope(s.intact_friction_angle, FrictionCone::kOuter), 1.329508, 1e-6);
  EXPECT_NEAR(friction_coefficient(s.intact_friction_angle, FrictionCone::kOuter), 0.626736, 1e-6);
  EXPECT_NEAR(friction_coefficient(s.damaged_friction_angle, FrictionCone::kOuter), 0.445300, 1e-6);
}

TEST(Strength, IntactRockIsLundborg) {
  const auto k = constants();
  EXPECT_NEAR(shear_strength(k, 0.0, 0.0), 1.0e8, 1.0);
  const double mu_i = 1.3295080, p = 1.0e9;  // slope to 8 digits
  EXPECT_NEAR(shear_strength(k, p, 0.0), 1.0e8 + mu_i * p / (1.0 + mu_i * p / 3.4e9), 100.0);
  EXPECT_LT(shear_strength(k, 1.0e14, 0.0), 3.5e9);
  EXPECT_GT(shear_strength(k, 1.0e14, 0.0), 3.4999e9);
}

TEST(Strength, DamagedRockIsACohesionlessConeCappedByTheIntactStrength) {
  const auto k = constants();
  EXPECT_EQ(shear_strength(k, 0.0, 1.0), 0.0);
  EXPECT_NEAR(shear_strength(k, 1.0e6, 1.0), 0.944625e6, 1.0);
  // The cone crosses the Lundborg curve at 1.349e9 Pa.
  EXPECT_LT(shear_strength(k, 1.348e9, 1.0), shear_strength(k, 1.348e9, 0.0));
  EXPECT_EQ(shear_strength(k, 1.350e9, 1.0), shear_strength(k, 1.350e9, 0.0));
  LiteralSwitches literal;
  literal.cap_damaged_yield = false;
  EXPECT_GT(shear_strength(constants(literal), 1.350e9, 1.0), shear_strength(k, 1.350e9, 0.0));
}

TEST(Strength, MeltFactorStaysWithinItsBounds) {
  const auto k = constants();
  EXPECT_EQ(melt_factor(k, 0.0), 1.0);
  EXPECT_NEAR(melt_factor(k, 1.7e6), 0.5, 1e-15);
  EXPECT_EQ(melt_factor(k, 3.4e6 * 2.0), 0.0);
  EXPECT_EQ(melt_factor(k, -1.0e6), 1.0);
}

TEST(Strength, ApexIsWhereTheStrengthVanishes) {
  LiteralSwitches hyperbola;
  hyperbola.linear_tension = false;
  EXPECT_NEAR(apex_pressure(constants(), 0.0, 1.0), -7.522e7, 5e3);
  EXPECT_NEAR(apex_pressure(constants(hyperbola), 0.0, 1.0), -7.307e7, 5e3);
  for (const auto& literal : {LiteralSwitches{}, hyperbola})
    for (double damage = 0.0; damage <= 1.0; damage += 0.125)
      for (const double melt : {1.0, 0.3, 1e-3, 0.0}) {
        const auto k = constants(literal);
        const double apex = apex_pressure(k, damage, melt);
        EXPECT_LE(apex, 0.0);
        // Y is a difference of terms of the size of the cohesion.
        EXPECT_NEAR(shear_strength(k, apex, damage, melt), 0.0, 1e-14 * 1e8) << damage << " " << melt;
      }
  EXPECT_EQ(apex_pressure(constants(), 1.0, 1.0), 0.0);
  EXPECT_EQ(apex_pressure(constants(), 0.0, 0.0), 0.0);
}

TEST(Strength, IsContinuousAndRisesWithPressureWithoutAPole) {
  const auto k = constants();
  // Steepest slope of sqrt(J2) over P: the intact one, 1.33.
  const double step = 1.0e6;
  for (const double damage : {0.0, 0.3, 0.7, 1.0})
    for (const double melt : {1.0, 0.5, 0.0}) {
      double before = shear_strength(k, -1.0e10, damage, melt);
      for (double p = -1.0e10 + step; p <= 1.0e11; p += step) {
        const double now = shear_strength(k, p, damage, melt);
        ASSERT_GE(now, before - 1e-3) << p << " " << damage << " " << melt;
        ASSERT_LE(now - before, 1.34 * step) << p << " " << damage << " " << melt;
        before = now;
        if (p > 1.0e9) p += 99.0 * step, before = shear_strength(k, p, damage, melt);
      }
    }
}

TEST(Strength, LiteralHyperbolaHasItsPole) {
  LiteralSwitches literal;
  literal.linear_tension = false;
  const auto k = constants(literal);
  EXPECT_LT(shear_strength(k, -2.55e9, 0.0), 0.0);
  EXPECT_GT(shear_strength(k, -2.565e9, 0.0), 0.0);
  EXPECT_LT(shear_strength(constants(), -2.565e9, 0.0), 0.0);
}

}  // namespace

// The constitutive update: elastic limits, plastic flow, energy budget, covariance, sound speed.
#include "material/constitutive.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "material_point.hpp"

namespace {

using namespace breccia;
using namespace breccia::material;
using namespace breccia::test;
using Eigen::Matrix3d;

constexpr double kShearModulus = 2.27e10, kBulkModulus = 2.67e10;

Matrix3d simple_shear(double rate) {
  Matrix3d l = Matrix3d::Zero();
  l(0, 1) = rate;
  return l;
}

TEST(Constitutive, SmallUniaxialStrainHasTheElasticModuli) {
  MaterialPoint<double, ElasticEffects> point;
  Matrix3d l = Matrix3d::Zero();
  l(0, 0) = -1e-6 / kStep;
  const Matrix3d tau = to_eigen(point.advance(l));
  const double q = viscous_kirchhoff_pressure(point.constants.viscosity, -1e-6 / kStep);
  // Second order in strain: 1e-6 relative to the first.
  EXPECT_NEAR(tau(0, 0) + q, -1e-6 * (kBulkModulus + 4.0 / 3.0 * kShearModulus), 0.2);
  EXPECT_NEAR(tau(1, 1) + q, -1e-6 * (kBulkModulus - 2.0 / 3.0 * kShearModulus), 0.2);
  EXPECT_EQ(tau(0, 1), 0.0);
}

TEST(Constitutive, HenckyStressIsExactForLargeStretch) {
  // Isochoric stretch by exp(0.3) along x: h = (0.3, -0.15, -0.15), beyond the reach of the series.
  MaterialPoint<double, ElasticEffects> point;
  const double x = std::expm1(0.3), y = std::expm1(-0.15);
  const Matrix3d a = Eigen::Vector3d(x, y, y).asDiagonal();
  const Matrix3d tau = to_eigen(point.advance(a, 1.0));
  EXPECT_NEAR(deviator(tau)(0, 0), 2.0 * kShearModulus * 0.3, 1e-12 * kShearModulus);
  EXPECT_NEAR(point.volume_ratio(), 1.0, 1e-15);
}

TEST(Constitutive, ShearYieldsAtTheStrengthAndNoFurther) {
  for (const double damage : {0.0, 0.5, 1.0}) {
    MaterialPoint<double> point;
    point.state.damage_root = std::cbrt(damage);
    point.state.volume.set(-1e-3);
    Matrix3d tau;
    for (int step = 0; step < 2000; ++step) tau = to_eigen(point.advance(simple_shear(1e-4)));
    const double pressure = -tau.trace() / 3.0;
    const double energy = point.state.energy.value();
    const double yield =
        yield_strain(point.constants.strength, pressure, damage, melt_factor(point.constants.strength, energy));
    EXPECT_GT(point.dissipation.plastic, 0.0);
    // The energy, hence Y, moved on by one half step of heating since the return.
    EXPECT_NEAR(deviator(tau).norm(), 2.0 * kShearModulus * yield, 1e-6 * deviator(tau).norm()) << damage;
  }
}

TEST(Constitutive, StressWorkIsElasticEnergyPlusPlasticDissipation) {
  // Isochoric shear at P = 0 up to ten times the yield strain.
  MaterialPoint<double> point;
  double plastic = 0.0;
  Matrix3d tau;
  for (int step = 0; step < 40000; ++step) {
    tau = to_eigen(point.advance(simple_shear(1e-5)));
    plastic += point.dissipation.plastic;
  }
  const double elastic = deviator(tau).squaredNorm() / (4.0 * kShearModulus);
  ASSERT_GT(plastic, 5.0 * elastic);
  // Trapezoidal work over steps of 1e-6 strain: relative error of order step over yield strain, 4e-4. Heating of 1 J/kg
  // raises P by 5 kPa, nothing here.
  EXPECT_NEAR(2700.0 * point.state.energy.value(), elastic + plastic, 4e-4 * plastic);
}

TEST(Constitutive, ElasticCycleReturnsItsWork) {
  std::mt19937_64 engine(3);
  Matrix3d shape = random_matrix(engine, 1.0);
  shape = 0.5 * (shape + shape.transpose()).eval();
  double highest = 0.0;
  RuntimeEffects fx;
  fx.strength = fx.damage = fx.viscosity = false;
  MaterialPoint<double, RuntimeEffects> cycled;
  cycled.fx = fx;
  for (int step = 0; step < 1000; ++step) {
    const double rate = 1e-4 * std::cos(2.0 * kPi * (step + 0.5) / 1000.0);
    cycled.advance(rate * shape);
    highest = std::max(highest, cycled.state.energy.value());
  }
  EXPECT_GT(highest, 1.0);
  // The time-centred work integral is second order: (2 pi / 1000)^2 per cycle.
  EXPECT_NEAR(cycled.state.energy.value(), 0.0, 4e-5 * highest);
}

TEST(Constitutive, FluidWorkIsColdWorkPlusViscousHeat) {
  MaterialPoint<double, FluidEffects> point;
  double viscous = 0.0, cold = 0.0;
  const Matrix3d l = -1e-5 / 3.0 * Matrix3d::Identity();
  for (int step = 0; step < 2000; ++step) {
    const double before = point.state.kirchhoff_pressure;
    point.advance(l);
    viscous += point.dissipation.viscous;
    cold += 0.5 * (before + point.state.kirchhoff_pressure) * 1e-5 * kStep;
  }
  // The first step starts from zero stress: half a viscous step of 2000 is missing.
  EXPECT_NEAR(2700.0 * point.state.energy.value(), cold, 1e-9 * cold);
  EXPECT_NEAR(viscous, 2.1227e5 * 1e-5 * 2000 * kStep, 1e-3 * viscous);
  EXPECT_LT(viscous, cold);
}

TEST(Constitutive, TensionFallsWithDamageAndEndsAtTheApex) {
  Matrix3d l = 1e-5 / kStep * Matrix3d::Identity();  // J - 1 = 3e-5, P about -0.8 MPa
  MaterialPoint<double> intact, half, granular;
  half.state.damage_root = std::cbrt(0.5);
  granular.state.damage_root = 1.0;
  const double p0 = -to_eigen(intact.advance(l)).trace() / 3.0;
  EXPECT_NEAR(p0, -3e-5 * kBulkModulus, 1e-4 * kBulkModulus * 3e-5 * 10.0);
  EXPECT_NEAR(-to_eigen(half.advance(l)).trace() / 3.0, 0.5 * p0, 1e-9 * std::abs(p0));
  EXPECT_EQ(to_eigen(granular.advance(l)).norm(), 0.0);

  // Pulled on, intact rock stays at its apex with no shear.
  for (int step = 0; step < 1000; ++step) intact.advance(l);
  EXPECT_NEAR(intact.state.kirchhoff_pressure, -7.522e7, 2e4);
  EXPECT_EQ(squared_norm(intact.state.elastic), 0.0);
}

// Viscous heat is the work of what q adds to the stress: damage takes its share of what only relieves tension (all of
// it where q is less than the tension), and beyond the apex q counts only where it is kept out of the yield strength. q
// of 21 MPa (closing at 1e-3 1/s) beside pressures of -54 to 27 MPa, with all of them above the apex of intact rock,
// -75 MPa.
TEST(Constitutive, ViscousHeatIsTheWorkOfWhatViscosityAddsToTheStress) {
  const Matrix3d l = -1e-3 / 3.0 * Matrix3d::Identity();
  for (const bool in_yield : {true, false}) {
    for (const double damage : {0.0, 0.5, 1.0}) {
      for (const double volume : {-1e-3, 0.0, 5e-4, 2e-3}) {
        LiteralSwitches literal;
        literal.viscosity_in_yield = in_yield;
        MaterialPoint<double, RuntimeEffects> with, without;
        without.fx.viscosity = false;
        for (auto* point : {&with, &without}) {
          point->constants = make_constants<double>(MaterialParameters{}, literal, kCell);
          point->state.damage_root = std::cbrt(damage);
          point->state.volume.set(volume);
          point->advance(l);
        }
        const double added = with.state.kirchhoff_pressure - without.state.kirchhoff_pressure;
        EXPECT_NEAR(with.dissipation.viscous, added * 1e-3 * kStep, 1e-9 * 2.1e7 * 1e-3 * kStep)
            << in_yield << " " << damage << " " << volume;
        EXPECT_EQ(without.dissipation.viscous, 0.0);
      }
    }
  }
}

TEST(Constitutive, ViscosityMayBeKeptOutOfTheYieldStrength) {
  // Closing at 1e-3 1/s gives q = 2.1e7 Pa, beside P = 2.7 MPa, in sheared debris.
  LiteralSwitches literal;
  literal.viscosity_in_yield = false;
  MaterialPoint<double> in, out;
  out.constants = make_constants<double>(MaterialParameters{}, literal, kCell);
  const Matrix3d l = simple_shear(1e-2) - 1e-3 / 3.0 * Matrix3d::Identity();
  for (auto* point : {&in, &out}) {
    point->state.damage_root = 1.0;
    point->state.volume.set(-1e-4);
    point->advance(l);
  }
  EXPECT_EQ(in.state.kirchhoff_pressure, out.state.kirchhoff_pressure);
  const double q = viscous_kirchhoff_pressure(in.constants.viscosity, -1e-3);
  const auto norm = [](const State<double>& s) {
    return 0.5 * std::sqrt(squared_norm(deviatoric_log(s.elastic, traceless_powers(s.elastic))));
  };
  EXPECT_NEAR(norm(in.state) / norm(out.state), in.state.kirchhoff_pressure / (in.state.kirchhoff_pressure - q), 1e-9);
}

TEST(Constitutive, ViscosityOutOfTheYieldStillActsBeyondTheApex) {
  // Debris at J - 1 = 1e-5 has no strength of its own; closing fast, q alone pushes it apart.
  LiteralSwitches literal;
  literal.viscosity_in_yield = false;
  MaterialPoint<double> point;
  point.constants = make_constants<double>(MaterialParameters{}, literal, kCell);
  point.state.damage_root = 1.0;
  point.state.volume.set(1e-5);
  Dissipation<double> d;
  const Mat3<double> closing = to_mat3<double>(-1e-3 / 3.0 * Matrix3d::Identity());
  update_stress(point.fx, point.constants, point.state, closing, 0.0, d);
  const double q = viscous_kirchhoff_pressure(point.constants.viscosity, -1e-3);
  EXPECT_NEAR(point.state.kirchhoff_pressure, q, 1e-12 * q);
}

TEST(Constitutive, RotatedMotionGivesTheRotatedStress) {
  std::mt19937_64 engine(8);
  for (int i = 0; i < 20; ++i) {
    MaterialPoint<double> a, b;
    const Matrix3d q = random_rotation(engine);
    Matrix3d tau_a, tau_b;
    for (int step = 0; step < 200; ++step) {
      const Matrix3d l = random_matrix(engine, 1e-4) - 1e-5 * Matrix3d::Identity();
      tau_a = to_eigen(a.advance(l));
      tau_b = to_eigen(b.advance(q * l * q.transpose()));
    }
    EXPECT_LE((tau_b - q * tau_a * q.transpose()).norm(), 1e-10 * tau_a.norm());
    EXPECT_NEAR(principal_strain(a.state), principal_strain(b.state), 1e-8);
  }
}

TEST(Constitutive, RigidRotationStrainsNothing) {
  // The exact discrete rotation I + A = R.
  MaterialPoint<double> point;
  const Matrix3d r = Eigen::AngleAxisd(3e-3, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (int step = 0; step < 10000; ++step) point.advance((r - Matrix3d::Identity()) / kStep);
  // R is orthogonal to rounding, and its error adds up: 1e4 steps of a few 1e-16.
  EXPECT_LT(std::abs(point.state.volume.value()), 5e-12);
  EXPECT_LT(squared_norm(point.state.elastic), 1e-24);
  EXPECT_LT(principal_strain(point.state), 1e-11);
}

TEST(Constitutive, LongitudinalSoundSpeedOfBasalt) {
  MaterialPoint<double> rock;
  MaterialPoint<double, FluidEffects> fluid;
  EXPECT_NEAR(longitudinal_sound_speed(rock.fx, rock.constants, rock.state), 4593.339, 1e-3);
  EXPECT_NEAR(longitudinal_sound_speed(fluid.fx, fluid.constants, fluid.state), 3144.660377, 1e-6);
}

}  // namespace

// States that break a careless implementation: the hard cases of physics.md 8 that live in one particle.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "material_point.hpp"

namespace {

using namespace breccia;
using namespace breccia::material;
using namespace breccia::test;
using Eigen::Matrix3d;

template <class T>
bool finite(const State<T>& s) {
  return to_eigen(s.elastic).allFinite() && std::isfinite(s.volume.high) && std::isfinite(s.energy.high) &&
         std::isfinite(s.kirchhoff_pressure) && to_eigen(s.total).allFinite();
}

template <class R>
class HardCase : public ::testing::Test {};
using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(HardCase, Reals);

// Case 3: a step with det(I + A) <= 0.
TYPED_TEST(HardCase, InvertedStepsStayFiniteAndShrinkTheVolumeTenfoldAtMost) {
  Matrix3d flip = Matrix3d::Zero();
  flip(0, 0) = -2.0;
  for (const Matrix3d& a : {Matrix3d(-1.5 * Matrix3d::Identity()), Matrix3d(-Matrix3d::Identity()), flip}) {
    MaterialPoint<TypeParam> point;
    for (int step = 0; step < 20; ++step) {
      const double before = point.volume_ratio();
      const auto tau = point.advance(a / kStep);
      EXPECT_TRUE(to_eigen(tau).allFinite());
      EXPECT_TRUE(finite(point.state));
      EXPECT_TRUE(std::isfinite(principal_strain(point.state)));
      EXPECT_GE(point.volume_ratio(), std::max(kLeastVolume, kLeastVolumeRatio * before) * (1.0 - 1e-4));
    }
  }
}

// Case 4: repeated eigenvalues; the stress turns with the strain.
TYPED_TEST(HardCase, RepeatedEigenvaluesGiveACovariantStress) {
  std::mt19937_64 engine(1);
  for (const double c : {0.0, 1e-6, 1e-3, 0.3})
    for (const double split : {0.0, 1.2e-7}) {
      const Matrix3d strain = Eigen::Vector3d(c, c * (1.0 + split), -2.0 * c).asDiagonal();
      MaterialPoint<TypeParam, ElasticEffects> straight, turned;
      const Matrix3d q = random_rotation(engine);
      straight.state.elastic = to_dev3<TypeParam>(strain);
      turned.state.elastic = to_dev3<TypeParam>(q * strain * q.transpose());
      const Matrix3d tau = to_eigen(straight.advance(Matrix3d(Matrix3d::Zero())));
      const Matrix3d rotated = to_eigen(turned.advance(Matrix3d(Matrix3d::Zero())));
      EXPECT_LE((rotated - q * tau * q.transpose()).norm(), 3e-6 * tau.norm()) << c;
    }
}

// Case 5: no strain and no strength.
TYPED_TEST(HardCase, UnstrainedDebrisWithoutPressureIsStressFree) {
  MaterialPoint<TypeParam> point;
  point.state.damage_root = TypeParam(1);
  const Matrix3d tau = to_eigen(point.advance(Matrix3d(Matrix3d::Zero())));
  EXPECT_EQ(tau.norm(), 0.0);
}

// Case 6: the return over the whole plane of pressure, damage and energy.
TYPED_TEST(HardCase, StressStaysWithinTheYieldSurfaceEverywhere) {
  using R = TypeParam;
  for (const double j : {-0.7, -0.2, -1e-3, 0.0, 1e-3, 0.02, 0.1, 0.12, 0.5, 10.0, 900.0})
    for (const double damage : {0.0, 0.5, 1.0})
      for (const double energy : {-10.0, 0.0, 1e6, 3.3e6, 1e7, 1e9}) {
        MaterialPoint<R> point;
        point.state.volume.set(R(j));
        point.state.energy.set(R(energy));
        point.state.damage_root = R(std::cbrt(damage));
        point.state.elastic = {R(0.05), R(-0.01), R(0.02), R(0.0), R(-0.03)};
        Dissipation<R> d;
        const Sym3<R> stress = update_stress(point.fx, point.constants, point.state, Mat3<R>{}, R(0), d);
        const Matrix3d tau = to_eigen(stress);
        ASSERT_TRUE(tau.allFinite() && finite(point.state));
        const double melt = std::clamp(1.0 - energy / 3.4e6, 0.0, 1.0);
        const auto k = make_strength_constants<double>({}, {});
        const double yield = yield_strain(k, -tau.trace() / 3.0, damage, melt) / k.inverse_two_mu;
        const double rounding = 1e-5 * (1.5e8 + std::abs(tau.trace()));
        EXPECT_LE(deviator(tau).norm(), std::max(yield, 0.0) + rounding) << j << " " << damage << " " << energy;
        EXPECT_GE(-tau.trace() / 3.0, apex_pressure(k, damage, melt) - rounding);
      }
}

// Case 8: a lone particle keeps expanding on its own gradient, and is pressed together later.
TYPED_TEST(HardCase, LoneExpandingParticleIsBoundedAndCanBeRecompressed) {
  for (const double damage : {0.0, 1.0}) {
    MaterialPoint<TypeParam> point;
    point.state.damage_root = TypeParam(damage);
    const Matrix3d expanding = 1e-3 / 3.0 * Matrix3d::Identity();
    for (int step = 0; step < 1000000; ++step) {
      point.advance(to_mat3<TypeParam>(expanding));
      // As the engine does: flaws open at strains near 1e-5, and within a few steps D = 1.
      if (step == 1000) point.state.damage_root = TypeParam(1);
    }
    EXPECT_TRUE(finite(point.state));
    EXPECT_NEAR(point.volume_ratio(), 1000.0, 0.01);
    EXPECT_EQ(double(point.state.kirchhoff_pressure), 0.0);
    for (int step = 0; step < 100000 && point.volume_ratio() > 0.99; ++step)
      point.advance(to_mat3<TypeParam>(Matrix3d(-1e-2 / 3.0 * Matrix3d::Identity())));
    EXPECT_TRUE(finite(point.state));
    EXPECT_GT(double(point.state.kirchhoff_pressure), 1e8);
    EXPECT_LT(double(point.state.kirchhoff_pressure), 1e9);
  }
}

// The other half of case 8: heated debris just beyond zero pressure still pushes.
TEST(HardCases, HeatedDebrisKeepsItsPressure) {
  MaterialPoint<double> point;
  point.state.damage_root = 1.0;
  point.state.volume.set(0.01);
  point.state.energy.set(1e5);
  point.advance(Matrix3d(Matrix3d::Zero()));
  EXPECT_GT(point.state.kirchhoff_pressure, 1e8);
}

// Case 20: a jump of damage in one step ends at 1, and at the share of the flaws that are open; none of it heals.
TYPED_TEST(HardCase, DamageNeverOvershoots) {
  using R = TypeParam;
  EXPECT_EQ(grow_damage_root(R(0), R(11), R(11), R(1e6)), R(1));
  EXPECT_NEAR(double(grow_damage_root(R(0), R(10), R(11), R(1e6))), std::cbrt(10.0 / 11.0), 1e-6);
  EXPECT_EQ(grow_damage_root(R(0.99), R(1), R(11), R(1e6)), R(0.99));
}

// Case 21: c^2 < 0 on the cold curve below eta = 0.5.
TYPED_TEST(HardCase, SoundSpeedIsFlooredWhereTheColdCurveIsUnstable) {
  using R = TypeParam;
  MaterialPoint<R> point;
  point.state.volume.set(R(1.0 / 0.3 - 1.0));
  const auto compression = compression_from_volume(point.state.volume.value());
  EXPECT_LT(double(tillotson_sound_speed_squared(point.constants.eos, compression, R(0))), 0.0);
  EXPECT_NEAR(double(longitudinal_sound_speed(point.fx, point.constants, point.state)), 4593.339, 0.01);
}

}  // namespace

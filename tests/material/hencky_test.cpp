// Series and fall-back of the Hencky strain against an eigen-decomposition in double precision.
#include "material/hencky.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "breccia/pack.hpp"
#include "random_tensors.hpp"

namespace {

using namespace breccia::material;
using namespace breccia::test;
using breccia::Dev3;
using breccia::Pack;
using Eigen::Matrix3d;

Matrix3d exact_log(const Matrix3d& e) {
  return deviator(spectral_map(e, [](double x) { return std::log1p(x); }));
}
/// expm1-based, so that tiny strains keep their digits.
Matrix3d exact_power(const Matrix3d& e, double exponent) {
  const Matrix3d p = spectral_map(e, [&](double x) { return std::expm1(exponent * std::log1p(x)); });
  return deviator(p) / (1.0 + p.trace() / 3.0);
}

/// Largest eigenvalues tried, up to bodies squeezed to a tenth: both sides of the switch to the fall-back.
constexpr double kAmplitudes[] = {1e-8, 1e-6, 1e-4, 1e-2, 0.05, 0.08, 0.09, 0.12, 0.3, 0.45};

template <class R>
class Hencky : public ::testing::Test {};
using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Hencky, Reals);

TYPED_TEST(Hencky, LogAndPowerMatchTheEigenDecomposition) {
  using R = TypeParam;
  // A few dozen roundings, each relative to the largest entry; the fall-back (six sweeps of rotations) about twice
  // that.
  const double tolerance = 16.0 * double(std::numeric_limits<R>::epsilon());
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0), exponents(0.0, 1.0);
  for (const double amplitude : kAmplitudes)
    for (int i = 0; i < 300; ++i) {
      const Dev3<R> e = to_dev3<R>(random_traceless(engine, amplitude * unit(engine), amplitude * unit(engine)));
      const Matrix3d exact = to_eigen(e);
      const double size = exact.norm() < 0.12 ? exact.norm() : std::max(exact.norm(), 0.5);
      const auto powers = traceless_powers(e);
      EXPECT_LE((to_eigen(deviatoric_log(e, powers)) - exact_log(exact)).norm(), tolerance * size) << amplitude;
      const R exponent = R(exponents(engine));
      EXPECT_LE((to_eigen(traceless_power(e, powers, exponent)) - exact_power(exact, double(exponent))).norm(),
                tolerance * size)
          << amplitude << " " << double(exponent);
    }
}

TYPED_TEST(Hencky, RepeatedEigenvaluesAreHarmless) {
  using R = TypeParam;
  const double tolerance = 16.0 * double(std::numeric_limits<R>::epsilon());
  std::mt19937_64 engine(2);
  for (const double c : {0.0, 1e-6, 1e-3, 0.07, 0.2, 0.4})
    for (const double sign : {1.0, -1.0})
      for (const double split : {0.0, 1.0}) {
        const double x = sign * c, y = x * (1.0 + split * double(std::numeric_limits<R>::epsilon()));
        const Dev3<R> e = to_dev3<R>(random_traceless(engine, x, y));
        const Matrix3d exact = to_eigen(e);
        const auto powers = traceless_powers(e);
        EXPECT_LE((to_eigen(deviatoric_log(e, powers)) - exact_log(exact)).norm(), tolerance * exact.norm());
        EXPECT_LE((to_eigen(traceless_power(e, powers, R(0.5))) - exact_power(exact, 0.5)).norm(),
                  tolerance * exact.norm());
      }
}

TYPED_TEST(Hencky, ReturnByOneKeepsTheStrainAndByZeroErasesIt) {
  using R = TypeParam;
  std::mt19937_64 engine(3);
  for (const double amplitude : {1e-6, 1e-3, 0.05}) {
    const Dev3<R> e = to_dev3<R>(random_traceless(engine, amplitude, -0.3 * amplitude));
    const auto powers = traceless_powers(e);
    EXPECT_EQ(to_eigen(traceless_power(e, powers, R(1))), to_eigen(e));
    EXPECT_EQ(to_eigen(traceless_power(e, powers, R(0))), Matrix3d(Matrix3d::Zero()));
  }
}

TYPED_TEST(Hencky, PowerScalesTheLogarithm) {
  using R = TypeParam;
  std::mt19937_64 engine(4);
  for (const double amplitude : {1e-5, 1e-2, 0.09, 0.25}) {
    const Dev3<R> e = to_dev3<R>(random_traceless(engine, amplitude, 0.4 * amplitude));
    const auto log = to_eigen(deviatoric_log(e, traceless_powers(e)));
    const Dev3<R> half = traceless_power(e, traceless_powers(e), R(0.375));
    const auto shrunk = to_eigen(deviatoric_log(half, traceless_powers(half)));
    EXPECT_LE((shrunk - 0.375 * log).norm(), 16.0 * double(std::numeric_limits<R>::epsilon()) * log.norm());
  }
}

TYPED_TEST(Hencky, NearlyFlattenedBodiesStayFinite) {
  using R = TypeParam;
  for (const double squeeze : {0.9, 0.999, 1.0}) {
    const Dev3<R> e{R(-squeeze), R(0.5 * squeeze), R(0), R(0), R(0)};
    EXPECT_TRUE(to_eigen(deviatoric_log(e, traceless_powers(e))).allFinite());
    EXPECT_TRUE(to_eigen(traceless_power(e, traceless_powers(e), R(0.1))).allFinite());
  }
}

TEST(HenckyPack, LanesOfBothKindsEqualScalars) {
  using P = Pack<float, 16>;
  std::mt19937_64 engine(5);
  Dev3<P> e{};
  Dev3<float> lanes[16];
  for (int i = 0; i < 16; ++i) {
    lanes[i] = to_dev3<float>(random_traceless(engine, i % 3 == 0 ? 0.3 : 1e-3, i % 3 == 0 ? -0.1 : 2e-3));
    e.xx.set(i, lanes[i].xx);
    e.yy.set(i, lanes[i].yy);
    e.xy.set(i, lanes[i].xy);
    e.xz.set(i, lanes[i].xz);
    e.yz.set(i, lanes[i].yz);
  }
  const auto log = deviatoric_log(e, traceless_powers(e));
  const auto power = traceless_power(e, traceless_powers(e), P(0.5F));
  for (int i = 0; i < 16; ++i) {
    const auto powers = traceless_powers(lanes[i]);
    const float rounding = 4.0F * std::numeric_limits<float>::epsilon() * (i % 3 == 0 ? 1.0F : 1e-2F);
    EXPECT_NEAR(log.xy[i], deviatoric_log(lanes[i], powers).xy, rounding);
    EXPECT_NEAR(power.xx[i], traceless_power(lanes[i], powers, 0.5F).xx, rounding);
  }
}

}  // namespace

// Own exp, log, log1p and cbrt against long double, in units in the last place.
#include "breccia/elementary.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "breccia/pack.hpp"

namespace {

template <class R>
double ulps(R value, long double exact) {
  const R rounded = static_cast<R>(exact);
  const R next = std::nextafter(std::fabs(rounded), std::numeric_limits<R>::infinity());
  const auto ulp = static_cast<long double>(next) - static_cast<long double>(std::fabs(rounded));
  return static_cast<double>(std::fabs(static_cast<long double>(value) - exact) / ulp);
}

template <class R>
class Elementary : public ::testing::Test {};
using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Elementary, Reals);

constexpr int kSamples = 200000;

TYPED_TEST(Elementary, ExpWithinTwoUlp) {
  using R = TypeParam;
  using Format = breccia::detail::FloatFormat<R>;
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<R> wide(Format::kExpMin, Format::kExpMax), narrow(R(-1), R(1));
  double worst = 0.0;
  for (int i = 0; i < kSamples; ++i)
    for (const R x : {wide(engine), narrow(engine)})
      worst = std::max(worst, ulps(breccia::exp(x), std::exp(static_cast<long double>(x))));
  EXPECT_LE(worst, 2.0);
  EXPECT_EQ(breccia::exp(R(0)), R(1));
  EXPECT_TRUE(std::isnormal(breccia::exp(R(-1.0e9))));
  EXPECT_TRUE(std::isfinite(breccia::exp(R(1.0e9))));
}

TYPED_TEST(Elementary, LogWithinTwoUlp) {
  using R = TypeParam;
  std::mt19937_64 engine(2);
  const R range = sizeof(R) == 4 ? R(86) : R(700);
  std::uniform_real_distribution<R> exponent(-range, range), near_one(R(0.5), R(2));
  double worst = 0.0;
  for (int i = 0; i < kSamples; ++i)
    for (const R x : {std::exp(exponent(engine)), near_one(engine)})
      worst = std::max(worst, ulps(breccia::log(x), std::log(static_cast<long double>(x))));
  EXPECT_LE(worst, 2.0);
  EXPECT_EQ(breccia::log(R(1)), R(0));
  EXPECT_TRUE(std::isfinite(breccia::log(R(0))));
}

TYPED_TEST(Elementary, Log1pWithinTwoUlpDownToTinyArguments) {
  using R = TypeParam;
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<R> exponent(R(-60), R(10)), negative(R(-0.999), R(0));
  double worst = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    const R x = std::exp(exponent(engine));
    for (const R y : {x, negative(engine), -std::min(x, R(0.9))})
      worst = std::max(worst, ulps(breccia::log1p(y), std::log1p(static_cast<long double>(y))));
  }
  EXPECT_LE(worst, 2.0);
  EXPECT_EQ(breccia::log1p(R(0)), R(0));
}

TYPED_TEST(Elementary, CubeRootWithinTwoUlp) {
  using R = TypeParam;
  std::mt19937_64 engine(4);
  std::uniform_real_distribution<R> unit(R(0), R(1));
  double worst = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    const R x = unit(engine);
    worst = std::max(worst, ulps(breccia::cbrt(x), std::cbrt(static_cast<long double>(x))));
  }
  EXPECT_LE(worst, 2.0);
  EXPECT_EQ(breccia::cbrt(R(0)), R(0));
  EXPECT_EQ(breccia::cbrt(R(1)), R(1));
}

TYPED_TEST(Elementary, PacksGiveTheBitsOfScalars) {
  using R = TypeParam;
  constexpr int kLanes = sizeof(R) == 4 ? 16 : 8;
  using P = breccia::Pack<R, kLanes>;
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<R> any(R(-80), R(80)), positive(R(1e-6), R(50));
  for (int i = 0; i < 2000; ++i) {
    P x, y;
    for (int lane = 0; lane < kLanes; ++lane) {
      x.set(lane, any(engine));
      y.set(lane, positive(engine));
    }
    const P e = breccia::exp(x), l = breccia::log(y), l1 = breccia::log1p(y), c = breccia::cbrt(y);
    for (int lane = 0; lane < kLanes; ++lane) {
      ASSERT_EQ(e[lane], breccia::exp(x[lane]));
      ASSERT_EQ(l[lane], breccia::log(y[lane]));
      ASSERT_EQ(l1[lane], breccia::log1p(y[lane]));
      ASSERT_EQ(c[lane], breccia::cbrt(y[lane]));
    }
  }
}

}  // namespace

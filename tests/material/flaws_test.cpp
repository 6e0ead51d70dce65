// Weibull flaws: the distribution, the expected number, and independence of who asks.
#include "material/flaws.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "breccia/constants.hpp"
#include "breccia/error.hpp"
#include "material/flaw_codes.hpp"

namespace {

using namespace breccia::material;
using breccia::DamageParameters;

const double kVolume = 4.0 / 3.0 * breccia::kPi * std::pow(50.0e3, 3);

std::vector<std::uint64_t> all(std::uint64_t n) {
  std::vector<std::uint64_t> indices(n);
  std::iota(indices.begin(), indices.end(), std::uint64_t{0});
  return indices;
}

TEST(Flaws, EveryParticleHasAscendingFlaws) {
  const FlawLists flaws = draw_flaws(5000, kVolume, {}, 1, 0, all(5000));
  ASSERT_EQ(flaws.first.size(), 5001U);
  for (std::size_t i = 0; i < 5000; ++i) {
    ASSERT_GE(flaws.of(i).size(), 1U);
    ASSERT_TRUE(std::is_sorted(flaws.of(i).begin(), flaws.of(i).end()));
  }
}

TEST(Flaws, FollowTheWeibullDistribution) {
  // The thresholds are the quantiles themselves, so count(eps_j < eps) = k V eps^m to one flaw and the rounding of
  // thresholds, half of 2^-11, which m = 9 magnifies: less than the 0.3 % that drawn thresholds would scatter.
  const DamageParameters basalt;
  const FlawLists flaws = draw_flaws(47324, kVolume, basalt, 1, 0, all(47324));
  std::vector<float> sorted = flaws.threshold;
  std::sort(sorted.begin(), sorted.end());
  for (const double strain : {3e-6, 5e-6, 8e-6, 1e-5}) {
    const auto count = double(std::lower_bound(sorted.begin(), sorted.end(), float(strain)) - sorted.begin());
    const double expected = basalt.weibull_k * kVolume * std::pow(strain, basalt.weibull_m);
    EXPECT_NEAR(count, expected, 1.0 + 9.0 * 0x1p-12 * expected) << strain;
  }
  EXPECT_NEAR(sorted.front(), 2.56e-6, 1e-8);
  // Which particles get them is random: in any half of the body the count has binomial scatter.
  const auto half = double(flaws.first[47324 / 2]);
  const auto total = double(flaws.threshold.size());
  EXPECT_NEAR(half, 0.5 * total, 5.0 * std::sqrt(0.25 * total));
}

TEST(Flaws, MeanNumberIsThatOfTheCouponCollector) {
  // N (ln N + 0.577) draws in the mean, with standard deviation N pi / sqrt(6).
  constexpr std::uint64_t kParticles = 2000;
  constexpr int kBodies = 200;
  double sum = 0.0;
  for (std::uint32_t body = 0; body < kBodies; ++body)
    sum += double(draw_flaws(kParticles, kVolume, {}, 9, body, all(kParticles)).threshold.size());
  const double n = double(kParticles), mean = sum / kBodies / n;
  const double standard_error = breccia::kPi / std::sqrt(6.0) / std::sqrt(double(kBodies));
  EXPECT_NEAR(mean, std::log(n) + 0.5772, 4.0 * standard_error);
}

TEST(Flaws, DoNotDependOnTheSubsetAskedFor) {
  const FlawLists full = draw_flaws(3000, kVolume, {}, 5, 2, all(3000));
  const std::vector<std::uint64_t> wanted{2999, 0, 64, 63, 1500, 65};
  const FlawLists part = draw_flaws(3000, kVolume, {}, 5, 2, wanted);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto a = part.of(i), b = full.of(wanted[i]);
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end())) << wanted[i];
  }
  EXPECT_EQ(draw_flaws(3000, kVolume, {}, 5, 2, {}).first, std::vector<std::uint32_t>{0});
}

TEST(Flaws, DependOnSeedAndBody) {
  const auto reference = draw_flaws(500, kVolume, {}, 5, 2, all(500)).first;
  EXPECT_EQ(draw_flaws(500, kVolume, {}, 5, 2, all(500)).first, reference);
  EXPECT_NE(draw_flaws(500, kVolume, {}, 6, 2, all(500)).first, reference);
  EXPECT_NE(draw_flaws(500, kVolume, {}, 5, 3, all(500)).first, reference);
}

TEST(Flaws, HugeWeibullConstantsNeitherOverflowNorUnderflow) {
  DamageParameters nakamura;
  nakamura.weibull_k = 1e61;
  nakamura.weibull_m = 16.0;
  const FlawLists flaws = draw_flaws(47324, kVolume, nakamura, 1, 0, all(47324));
  const auto [low, high] = std::minmax_element(flaws.threshold.begin(), flaws.threshold.end());
  EXPECT_NEAR(*low, 1.9e-5, 0.1e-5);
  EXPECT_NEAR(*high, 4.2e-5, 0.2e-5);
}

TEST(FlawCodes, AreWithinHalfALastBitAndAscend) {
  FlawCode last = 0;
  for (double strain = 4e-9; strain < 15.9; strain *= 1.0001) {
    const FlawCode code = flaw_code(static_cast<float>(strain));
    ASSERT_GE(code, last) << strain;
    last = code;
    // Half of the last of 11 bits; the threshold is a float besides.
    ASSERT_NEAR(threshold_of(code), strain, (0x1p-12 + 0x1p-24) * strain);
    ASSERT_EQ(flaw_code(threshold_of(code)), code);
  }
}

TEST(FlawCodes, OutOfRangeIsTheWeakestAndNever) {
  EXPECT_EQ(threshold_of(flaw_code(1e-12F)), kWeakestFlaw);
  EXPECT_EQ(threshold_of(flaw_code(0.0F)), kWeakestFlaw);
  EXPECT_EQ(flaw_code(17.0F), kNeverGrows);
  EXPECT_EQ(flaw_code(1e30F), kNeverGrows);
  // No strain of a particle is that large.
  EXPECT_EQ(threshold_of(kNeverGrows), 1e30F);
}

TEST(Flaws, RefuseAParticleOutsideTheBody) {
  const std::vector<std::uint64_t> outside{10};
  EXPECT_THROW(draw_flaws(10, kVolume, {}, 1, 0, outside), breccia::UsageError);
}

// Particles keep places in 32 bits with a sign.
TEST(Flaws, PlacesBeyondTheirBitsAreRefused) {
  constexpr std::size_t most = std::numeric_limits<std::int32_t>::max();
  EXPECT_EQ(flaw_place(most), std::numeric_limits<std::int32_t>::max());
  EXPECT_THROW(flaw_place(most + 1), breccia::NumericsError);
}

}  // namespace

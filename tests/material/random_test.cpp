// Philox4x32-10: known answers of Random123, uniformity, and the integer draw.
#include "breccia/random.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace {

using breccia::RandomStream;
using Words = std::array<std::uint32_t, 4>;

TEST(Philox, KnownAnswersOfRandom123) {
  EXPECT_EQ(breccia::philox4x32({0, 0, 0, 0}, {0, 0}), (Words{0x6627e8d5U, 0xe169c58dU, 0xbc57ac4cU, 0x9b00dbd8U}));
  const std::uint32_t f = 0xffffffffU;
  EXPECT_EQ(breccia::philox4x32({f, f, f, f}, {f, f}), (Words{0x408f276dU, 0x41c83b0eU, 0xa20bc7c6U, 0x6d5451fdU}));
  EXPECT_EQ(breccia::philox4x32({0x243f6a88U, 0x85a308d3U, 0x13198a2eU, 0x03707344U}, {0xa4093822U, 0x299f31d0U}),
            (Words{0xd16cfe09U, 0x94fdccebU, 0x5001e420U, 0x24126ea1U}));
}

TEST(RandomStream, IsAFunctionOfSeedStreamAndCounter) {
  const RandomStream a(7, 1), b(7, 2), c(8, 1);
  EXPECT_EQ(a.words(5), RandomStream(7, 1).words(5));
  EXPECT_NE(a.words(5), a.words(6));
  EXPECT_NE(a.words(5), a.words(5, 1));
  EXPECT_NE(a.words(5), b.words(5));
  EXPECT_NE(a.words(5), c.words(5));
  EXPECT_NE(a.words(5), a.words(5 + (std::uint64_t{1} << 32U)));
}

TEST(RandomStream, UniformDoublesHaveTheMomentsOfTheUniformDistribution) {
  const RandomStream random(3, 0);
  constexpr int kPairs = 100000;
  double sum = 0.0, squares = 0.0, product = 0.0;
  for (std::uint64_t i = 0; i < kPairs; ++i) {
    const auto [x, y] = random.uniform(i);
    ASSERT_TRUE(x >= 0.0 && x < 1.0 && y >= 0.0 && y < 1.0);
    sum += x + y;
    squares += x * x + y * y;
    product += (x - 0.5) * (y - 0.5);
  }
  // Five standard errors: of the mean sqrt(1/12/n), of x^2 sqrt(4/45/n), of the product 1/12/sqrt(n).
  const double n = 2.0 * kPairs;
  EXPECT_NEAR(sum / n, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / n));
  EXPECT_NEAR(squares / n, 1.0 / 3.0, 5.0 * std::sqrt(4.0 / 45.0 / n));
  EXPECT_NEAR(product / kPairs, 0.0, 5.0 / 12.0 / std::sqrt(double(kPairs)));
}

TEST(RandomStream, IntegersBelowAreUnbiased) {
  const RandomStream random(11, 4);
  constexpr std::uint64_t kDraws = 600000, kValues = 6;
  std::vector<double> count(kValues);
  for (std::uint64_t i = 0; i < kDraws; ++i) count[random.below(i, kValues)] += 1.0;
  const double expected = double(kDraws) / double(kValues);
  double chi_square = 0.0;
  for (const double c : count) chi_square += (c - expected) * (c - expected) / expected;
  EXPECT_LT(chi_square, 25.7);  // 5 degrees of freedom, probability 1e-4

  // n = 3 * 2^62: without rejection a third of the values would come up twice as often as the others.
  const std::uint64_t n = std::uint64_t{3} << 62U;
  std::uint64_t lowest_third = 0;
  for (std::uint64_t i = 0; i < 30000; ++i) lowest_third += random.below(i, n) % 3 == 0 ? 1 : 0;
  EXPECT_NEAR(double(lowest_third), 10000.0, 5.0 * std::sqrt(30000.0 * 2.0 / 9.0));
  EXPECT_EQ(random.below(1, 1), 0U);
}

}  // namespace

// Sums of the budget do not depend on how particles are ordered or shared.
#include "sim/compensated_sums.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace breccia::sim {
namespace {

constexpr double kUlp = std::numeric_limits<double>::epsilon();

TEST(CompensatedSums, AMillionOddMassesAddUpAsTheirProduct) {
  constexpr std::size_t kParticles = 1000000;
  constexpr double kMass = 3.428099e12 / 7.0;
  for (const std::size_t ranks : {1, 2, 7}) {
    CompensatedSums<1> all;
    for (std::size_t rank = 0; rank < ranks; ++rank) {
      CompensatedSums<1> own;
      for (std::size_t i = rank; i < kParticles; i += ranks) own.add(0, kMass);
      for (std::size_t part = 0; part < own.parts().size(); ++part) all.parts()[part] += own.parts()[part];
    }
    // Rounding of the product, of the last sum and of each rank's; a plain sum is 1e-11 off.
    EXPECT_NEAR(all[0] / (kMass * kParticles), 1.0, static_cast<double>(ranks + 1) * kUlp) << ranks;
  }
}

TEST(CompensatedSums, WhatCancelsLeavesTheSmallTerm) {
  CompensatedSums<2> sums;
  for (const double term : {1e30, 1.0, -1e30}) sums.add(1, term);
  EXPECT_EQ(sums[0], 0.0);
  EXPECT_EQ(sums[1], 1.0);
}

}  // namespace
}  // namespace breccia::sim

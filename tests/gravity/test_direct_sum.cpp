// Direct summation against exact two-body values and against the plain double loop, on any number of ranks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "breccia/error.hpp"
#include "deal_out.hpp"
#include "gravity/solver.hpp"
#include "plain_sum.hpp"

namespace breccia::gravity {
namespace {

constexpr double kSoftening = 125.0;

Result evaluate(const Cloud& cloud, const Parameters& parameters, const Owner& owner, int threads = 1) {
  return evaluate(GravityMethod::kDirect, cloud, parameters, owner, threads);
}

TEST(DirectSum, TwoBodiesPullEachOtherByTheInverseSquareLaw) {
  const Cloud pair{{{1e6, -2e6, 3e6}, {1e6 + 3e4, -2e6 + 4e4, 3e6}}, {1.4e18, 2.8e18}};
  for (const double softening : {0.0, kSoftening}) {
    const Result result = evaluate(pair, {softening, Precision::kDouble}, round_robin());
    const double r = std::hypot(5e4, softening);
    const double a0 = kGravitationalConstant * 2.8e18 * 5e4 / (r * r * r);
    // Tolerance: a few roundings of double.
    EXPECT_NEAR(result.field.acceleration[0].x, 0.6 * a0, 1e-14 * a0);
    EXPECT_NEAR(result.field.acceleration[0].y, 0.8 * a0, 1e-14 * a0);
    EXPECT_NEAR(result.field.acceleration[1].x, -0.3 * a0, 1e-14 * a0);
    EXPECT_NEAR(result.field.acceleration[1].y, -0.4 * a0, 1e-14 * a0);
    EXPECT_EQ(result.field.acceleration[1].z, 0.0);
    // The energy of the pair counts it once: 1/2 sum(m phi) = -G m1 m2 / r.
    const double energy = 0.5 * (1.4e18 * result.field.potential[0] + 2.8e18 * result.field.potential[1]);
    EXPECT_NEAR(energy / (-kGravitationalConstant * 1.4e18 * 2.8e18 / r), 1.0, 1e-14);
  }
}

TEST(DirectSum, MatchesThePlainLoopInDouble) {
  const Cloud cloud = two_spheres(1537);
  const Field plain = plain_sum(cloud, kSoftening);
  const Result result = evaluate(cloud, {kSoftening, Precision::kDouble}, round_robin());
  // Sums of 1536 terms in another order: sqrt(1536) roundings of 1e-16.
  EXPECT_LT(rms_error(result.field.acceleration, plain.acceleration), 1e-14);
  EXPECT_LT(largest_relative_error(result.field.potential, plain.potential), 1e-13);
}

TEST(DirectSum, MatchesThePlainLoopInMixedPrecision) {
  const Cloud cloud = two_spheres(1537);
  const Field plain = plain_sum(cloud, kSoftening);
  const Result result = evaluate(cloud, {kSoftening, Precision::kMixed}, round_robin());
  // gravity.md 2: float pairs on exact differences and double sums give 5e-7.
  EXPECT_LT(rms_error(result.field.acceleration, plain.acceleration), 5e-7);
  EXPECT_LT(largest_relative_error(result.field.potential, plain.potential), 1e-6);
}

TEST(DirectSum, MatchesThePlainLoopWithoutSoftening) {
  const Cloud cloud = two_spheres(700);
  const Field plain = plain_sum(cloud, 0.0);
  EXPECT_LT(rms_error(evaluate(cloud, {0.0, Precision::kDouble}, round_robin()).field.acceleration, plain.acceleration),
            1e-14);
  EXPECT_LT(rms_error(evaluate(cloud, {0.0, Precision::kMixed}, round_robin()).field.acceleration, plain.acceleration),
            5e-7);
}

// physics.md 8, case 14.
TEST(DirectSum, CoincidentParticlesLeaveEachOtherAlone) {
  const Vec3d here{1e5, 2e5, -3e5};
  const Cloud cloud{{here, here, here + Vec3d{5e4, 0, 0}}, {3e13, 3e13, 6e13}};
  for (const Precision precision : {Precision::kMixed, Precision::kDouble}) {
    for (const double softening : {0.0, 1e-9, kSoftening}) {
      const Field field = evaluate(cloud, {softening, precision}, round_robin()).field;
      const double pull = kGravitationalConstant * 6e13 / (5e4 * 5e4);
      EXPECT_NEAR(field.acceleration[0].x / pull, 1.0, 1e-5);
      EXPECT_EQ(field.acceleration[0].x, field.acceleration[1].x);
      EXPECT_NEAR(field.acceleration[2].x / pull, -1.0, 1e-5);
      EXPECT_EQ(field.acceleration[0].y, 0.0);
      EXPECT_TRUE(std::isfinite(field.potential[0]));
      // The two sit on different ranks, which sum in different orders.
      EXPECT_NEAR(field.potential[0] / field.potential[1], 1.0, 1e-6);
    }
  }
  // Softened, the two see each other's potential but not their own.
  const Field field = evaluate(cloud, {kSoftening, Precision::kDouble}, round_robin()).field;
  const double expected = -kGravitationalConstant * (3e13 / kSoftening + 6e13 / std::hypot(5e4, kSoftening));
  EXPECT_NEAR(field.potential[0] / expected, 1.0, 1e-14);
}

// A softening far below the distances would drown a potential that contained the self term and lost it later.
TEST(DirectSum, SelfPotentialIsLeftOutExactly) {
  const Cloud cloud = two_spheres(300);
  const Field plain = plain_sum(cloud, 1e-3);
  EXPECT_LT(largest_relative_error(evaluate(cloud, {1e-3, Precision::kMixed}, round_robin()).field.potential,
                                   plain.potential),
            1e-6);
}

// physics.md 8, case 15.
TEST(DirectSum, ForcesSumToZero) {
  const Cloud cloud = two_spheres(3000);
  const Result single = evaluate(cloud, {kSoftening, Precision::kMixed}, round_robin());
  const Result twice = evaluate(cloud, {kSoftening, Precision::kDouble}, round_robin());
  EXPECT_LT(single.stats.momentum_error, 1e-7);
  EXPECT_LT(twice.stats.momentum_error, 1e-14);
  EXPECT_GT(single.stats.momentum_error, 0.0);
  EXPECT_EQ(single.stats.net_force_removed.x, 0.0);
}

// Debris 1e4 km out, its particles scattered among those of the remnant in memory: float coordinates would be good to
// 0.5 m only and miss this by a factor of twenty (gravity.md 2).
TEST(DirectSum, FarFragmentsKeepFloatAccuracy) {
  Cloud cloud;
  std::mt19937_64 random(11);
  add_ball(cloud, 1000, {0, 0, 0}, 3e4, random);
  for (int k = 0; k < 10; ++k) {
    const double angle = 0.2 * std::numbers::pi * k;
    add_ball(cloud, 60, {1e7 * std::cos(angle), 1e7 * std::sin(angle), 3e6 * k}, 1e4, random);
  }
  std::vector<std::size_t> order(cloud.position.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), random);
  Cloud shuffled;
  for (const std::size_t i : order) {
    shuffled.position.push_back(cloud.position[i]);
    shuffled.mass.push_back(cloud.mass[i]);
  }
  const Field plain = plain_sum(shuffled, kSoftening);
  const Result result = evaluate(shuffled, {kSoftening, Precision::kMixed}, round_robin());
  EXPECT_LT(rms_error(result.field.acceleration, plain.acceleration), 1e-6);
}

TEST(DirectSum, AnyDistributionGivesTheSameField) {
  const Cloud cloud = two_spheres(1000);
  const int last = mpi::Comm().size() - 1;
  const Field even = evaluate(cloud, {kSoftening, Precision::kDouble}, round_robin()).field;
  const Field one_rank = evaluate(cloud, {kSoftening, Precision::kDouble}, [&](std::size_t) { return last; }).field;
  const Field uneven =
      evaluate(cloud, {kSoftening, Precision::kDouble}, [&](std::size_t i) { return i < 3 ? 0 : last; }).field;
  EXPECT_LT(rms_error(one_rank.acceleration, even.acceleration), 1e-12);
  EXPECT_LT(rms_error(uneven.acceleration, even.acceleration), 1e-12);
  EXPECT_LT(largest_relative_error(one_rank.potential, even.potential), 1e-12);
}

TEST(DirectSum, MoreRanksThanParticles) {
  const Cloud one{{{1e5, 0, 0}}, {1e15}};
  const Result alone = evaluate(one, {kSoftening, Precision::kMixed}, round_robin());
  EXPECT_EQ(alone.field.acceleration[0].x, 0.0);
  EXPECT_EQ(alone.field.potential[0], 0.0);
  const Result none = evaluate({}, {kSoftening, Precision::kMixed}, round_robin());
  EXPECT_EQ(none.stats.momentum_error, 0.0);
  const Cloud massless{{{0, 0, 0}, {1e3, 0, 0}}, {0.0, 0.0}};
  EXPECT_EQ(evaluate(massless, {0.0, Precision::kMixed}, round_robin()).field.acceleration[0].x, 0.0);
}

TEST(DirectSum, ThreadsDoNotChangeABit) {
  const Cloud cloud = two_spheres(900);
  const Field one = evaluate(cloud, {kSoftening, Precision::kMixed}, round_robin(), 1).field;
  const Field three = evaluate(cloud, {kSoftening, Precision::kMixed}, round_robin(), 3).field;
  for (std::size_t i = 0; i < one.potential.size(); ++i) {
    EXPECT_EQ(one.acceleration[i].x, three.acceleration[i].x);
    EXPECT_EQ(one.potential[i], three.potential[i]);
  }
}

TEST(DirectSum, CountsPairsAndBytes) {
  const Cloud cloud = two_spheres(500);
  const mpi::Comm comm;
  const Stats stats = evaluate(cloud, {kSoftening, Precision::kMixed}, round_robin()).stats;
  EXPECT_EQ(comm.sum(stats.pairs), 500.0 * 500.0);
  EXPECT_EQ(stats.bytes_sent > 0.0, comm.size() > 1);
}

TEST(MakeSolver, RefusesWhatIsNotThere) {
  const mpi::Comm comm;
  EXPECT_THROW(make_solver(GravityMethod::kOff, {}, comm, 1), UsageError);
  EXPECT_THROW(make_solver(GravityMethod::kDirect, {-1.0, Precision::kMixed}, comm, 1), UsageError);
  EXPECT_NE(make_solver(GravityMethod::kAuto, {}, comm, 1), nullptr);
}

}  // namespace
}  // namespace breccia::gravity

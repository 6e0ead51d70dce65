// Method auto: the cheapest that is accurate enough, agreed upon by the ranks.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "deal_out.hpp"
#include "gravity/mesh/layout.hpp"

namespace breccia::gravity {
namespace {

constexpr double kSoftening = 125.0;

// A cloud so thin beyond its ball that nothing there is dense.
void add_debris(Cloud& cloud, std::size_t count, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d p{unit(random), unit(random), unit(random)};
    cloud.position.push_back(1.2e5 * std::pow(150.0, 0.5 * (1.0 + unit(random))) / std::sqrt(dot(p, p)) * p);
    cloud.mass.push_back(3e13);
  }
}

Cloud ball_with_debris(std::size_t ball, std::size_t debris) {
  Cloud cloud;
  std::mt19937_64 random(11);
  add_ball(cloud, ball, {}, 5e4, random);
  add_debris(cloud, debris, random);
  return cloud;
}

Result automatic(const Cloud& cloud, double error = 3.5e-4) {
  return evaluate(GravityMethod::kAuto, cloud, {.softening = kSoftening, .error = error}, round_robin());
}

TEST(AutoSolver, FollowsTheMatter) {
  EXPECT_EQ(automatic(two_spheres(1000)).stats.method, GravityMethod::kDirect);
  EXPECT_EQ(automatic(two_spheres(6000)).stats.method, GravityMethod::kTree);
  EXPECT_EQ(automatic(two_spheres(32000)).stats.method, GravityMethod::kTreePm);
  EXPECT_EQ(automatic(ball_with_debris(32000, 4000)).stats.method, GravityMethod::kTreePm);
  EXPECT_EQ(automatic(ball_with_debris(1500, 4500)).stats.method, GravityMethod::kTree);
  EXPECT_EQ(automatic(ball_with_debris(0, 4000)).stats.method, GravityMethod::kTree);
}

TEST(AutoSolver, GivesTheFieldOfTheMethodItNames) {
  const Parameters parameters{.softening = kSoftening};
  for (const Cloud& cloud : {two_spheres(32000), ball_with_debris(1500, 4500), two_spheres(1000)}) {
    const Result chosen = automatic(cloud);
    const Result named = evaluate(chosen.stats.method, cloud, parameters, round_robin());
    for (std::size_t i = 0; i < cloud.position.size(); ++i) {
      ASSERT_EQ(chosen.field.acceleration[i].x, named.field.acceleration[i].x);
      ASSERT_EQ(chosen.field.potential[i], named.field.potential[i]);
    }
    EXPECT_FALSE(chosen.stats.reason.empty());
    EXPECT_TRUE(named.stats.reason.empty());
  }
}

// The method must not hang on how many ranks hold the particles, nor on which.
TEST(AutoSolver, RanksAgreeAndSoDoRunsOfOtherRanks) {
  const mpi::Comm comm;
  const Cloud cloud = ball_with_debris(32000, 4000);
  const Parameters parameters{.softening = kSoftening};
  const GravityMethod mine = automatic(cloud).stats.method;
  const GravityMethod on_one =
      evaluate(GravityMethod::kAuto, cloud, parameters, [](std::size_t) { return 0; }).stats.method;
  EXPECT_EQ(comm.max(static_cast<std::int32_t>(mine)), comm.min(static_cast<std::int32_t>(mine)));
  EXPECT_EQ(mine, on_one);
}

// Whatever rank holds what, all know the bodies; a box takes in what debris there is beside its body.
TEST(Matter, IsThatOfAllRanks) {
  const mpi::Comm comm;
  const Cloud cloud = ball_with_debris(8000, 2000);
  Cloud mine;
  for (std::size_t i = 0; i < cloud.position.size(); ++i) {
    if (static_cast<int>(i) % comm.size() != comm.rank()) continue;
    mine.position.push_back(cloud.position[i]);
    mine.mass.push_back(cloud.mass[i]);
  }
  const auto mass = [&](std::size_t count) {
    return std::accumulate(cloud.mass.begin(), cloud.mass.begin() + static_cast<std::ptrdiff_t>(count), 0.0);
  };
  const Layout layout = lay_boxes({mine.position, mine.mass}, {}, comm, 1);
  ASSERT_EQ(layout.boxes.size(), 1U);
  EXPECT_NEAR(layout.mass[0] + layout.mass[1], mass(10000), 1e-12 * mass(10000));
  EXPECT_NEAR(layout.mass[1], mass(8000), 0.02 * mass(8000));
  const DenseBody body = matter_of(layout).bodies.at(0);
  EXPECT_NEAR(body.mass_share, mass(8000) / mass(10000), 0.02);
  EXPECT_EQ(body.particles, layout.count[1]);
}

// Bodies of `particles` each that together are the share `mass` of all.
std::vector<DenseBody> bodies(std::size_t count, std::uint64_t particles, double mass, double pull = 0.0) {
  return {count, DenseBody{.particles = particles, .mass_share = mass / static_cast<double>(count), .pull = pull}};
}

TEST(CheapestMethod, MeshOnlyWhereDenseBodiesHoldMostParticles) {
  const auto method = [](const Matter& matter, double error) {
    return cheapest_method(matter, {.error = error}).method;
  };
  // gravity.md 3, states (a), (b) and (c): nodes as laid at 1.3 spacings.
  const Matter two_bodies{.particles = 94648, .in_boxes = 94648, .mesh_nodes = 2.2e5, .bodies = bodies(1, 94648, 1.0)};
  const Matter body_with_debris{
      .particles = 94648, .in_boxes = 70986, .mesh_nodes = 1.5e5, .bodies = bodies(1, 70986, 0.75)};
  const Matter fragments{
      .particles = 1000000, .in_boxes = 134000, .mesh_nodes = 2e5, .bodies = bodies(1, 134000, 0.134)};
  EXPECT_EQ(method(two_bodies, 3.5e-4), GravityMethod::kTreePm);
  EXPECT_EQ(method(body_with_debris, 3.5e-4), GravityMethod::kTreePm);
  EXPECT_EQ(method(fragments, 3.5e-4), GravityMethod::kTree);
  EXPECT_EQ(method({.particles = 1'000'000}, 3.5e-4), GravityMethod::kTree);
  // Errors beyond the mesh, then beyond float fields.
  EXPECT_EQ(method(two_bodies, 1e-5), GravityMethod::kTree);
  EXPECT_EQ(method(two_bodies, 1e-8), GravityMethod::kDirect);
  EXPECT_EQ(method({.particles = 1000}, 3.5e-4), GravityMethod::kDirect);
}

// Two bodies for which a mesh is dearer than the tree, whose opening is wider than the error asks for.
TEST(CheapestMethod, NetForceOnBodiesMayDecideForTheMesh) {
  const auto method = [](std::uint64_t particles, double pull, double opening) {
    const Matter matter{.particles = 2 * particles,
                        .in_boxes = 2 * particles,
                        .mesh_nodes = 4.0 * static_cast<double>(particles),
                        .bodies = bodies(2, particles, 1.0, pull)};
    return cheapest_method(matter, {.opening = opening}).method;
  };
  EXPECT_EQ(method(12'000, 0.0, 0.0), GravityMethod::kTree);
  EXPECT_EQ(method(12'000, 0.0, 4e-3), GravityMethod::kTreePm);
  // Nobody notices where the bodies pull each other strongly.
  EXPECT_EQ(method(12'000, 0.1, 4e-3), GravityMethod::kTree);
  // Bodies too small for the mesh's accuracy stay with the tree.
  EXPECT_EQ(method(4'000, 0.0, 4e-3), GravityMethod::kTree);
}

}  // namespace
}  // namespace breccia::gravity

// Nothing must be seen of where boxes end, appear and split (gravity.md 6.8).
#include <gtest/gtest.h>

#include <cmath>

#include "deal_out.hpp"
#include "gravity/mesh/layout.hpp"

namespace breccia::gravity {
namespace {

constexpr double kRadius = 5e4;
constexpr std::size_t kBody = 2500;
const double kSpacing = kRadius * std::cbrt(4.0 / 3.0 * kPi / static_cast<double>(kBody));

double norm(Vec3d v) { return std::sqrt(dot(v, v)); }

Parameters settings() {
  return {.softening = 0.05 * kSpacing, .mesh = {.particle_spacing = kSpacing}, .error = 3.5e-4};
}

Result by(GravityMethod method, const Cloud& cloud) { return evaluate(method, cloud, settings(), round_robin()); }

Field exact(const Cloud& cloud) {
  return evaluate(GravityMethod::kDirect, cloud, {.softening = settings().softening, .precision = Precision::kDouble},
                  round_robin())
      .field;
}

Cloud rock(Vec3d centre) {
  Cloud cloud;
  std::mt19937_64 random(21);
  add_rock(cloud, kBody, centre, kRadius, random);
  return cloud;
}

// gravity.md 7 allows 4.5e-4 in bodies of 47,324 particles; the split follows their number, but in steps.
constexpr double kTolerance = 1.2 * 4.5e-4;

TEST(MovingBoxes, AParticleFeelsNothingAtTheBorder) {
  Cloud cloud = rock({});
  const std::size_t probe = cloud.position.size();
  cloud.position.push_back({});
  cloud.mass.push_back(3e13);
  const mpi::Comm self(MPI_COMM_SELF);
  bool was_inside = false, was_outside = false;
  Vec3d error_before{};
  for (int k = 0; k <= 40; ++k) {
    const double r = (1.05 + 0.02 * k) * kRadius;
    cloud.position[probe] = {0.6 * r, 0.0, 0.8 * r};
    const bool inside = lay_boxes({cloud.position, cloud.mass}, settings().mesh, self, 1).set[probe] > 0;
    (inside ? was_inside : was_outside) = true;
    const Vec3d should = exact(cloud).acceleration[probe];
    const Vec3d error = by(GravityMethod::kTreePm, cloud).field.acceleration[probe] - should;
    EXPECT_LT(norm(error), 1e-3 * norm(should)) << "at " << r;
    const double jump = k > 0 ? norm(error - error_before) : 0.0;
    EXPECT_LT(jump, 1e-3 * norm(should)) << "at " << r;
    error_before = error;
  }
  EXPECT_TRUE(was_inside && was_outside);
}

TEST(MovingBoxes, BodiesThatPartGetABoxEach) {
  int fewest = 9, most = 0;
  for (const double distance : {2.0, 4.0, 6.0, 8.0, 12.0, 20.0}) {
    Cloud cloud = rock({-0.5 * distance * kRadius, 0, 0});
    const Cloud other = rock({0.5 * distance * kRadius, 0.3 * distance * kRadius, 0});
    cloud.position.insert(cloud.position.end(), other.position.begin(), other.position.end());
    cloud.mass.insert(cloud.mass.end(), other.mass.begin(), other.mass.end());
    const Result result = by(GravityMethod::kTreePm, cloud);
    EXPECT_LT(rms_error(result.field.acceleration, exact(cloud).acceleration), kTolerance) << "distance " << distance;
    fewest = std::min(fewest, result.stats.boxes);
    most = std::max(most, result.stats.boxes);
  }
  EXPECT_EQ(fewest, 1);
  EXPECT_EQ(most, 2);
}

TEST(MovingBoxes, ABodyThatDispersesLosesItsBox) {
  int fewest = 9, most = 0;
  for (const double growth : {1.0, 1.3, 1.6, 2.0, 2.4, 3.0}) {
    Cloud cloud = rock({});
    for (Vec3d& x : cloud.position) x = growth * x;
    const Result result = by(GravityMethod::kTreePm, cloud);
    EXPECT_LT(rms_error(result.field.acceleration, exact(cloud).acceleration), kTolerance) << "growth " << growth;
    fewest = std::min(fewest, result.stats.boxes);
    most = std::max(most, result.stats.boxes);
  }
  EXPECT_EQ(fewest, 0);
  EXPECT_EQ(most, 1);
}

TEST(Tree, ALoneBodyNeitherDriftsNorSpins) {
  const Cloud cloud = rock({1.3e6, -7e5, 2e5});
  const Field field = by(GravityMethod::kTree, cloud).field;
  Vec3d centre{}, mean{}, torque{};
  double moment = 0.0;
  const double n = static_cast<double>(cloud.position.size());
  for (std::size_t i = 0; i < cloud.position.size(); ++i) {
    centre += (1.0 / n) * cloud.position[i];
    mean += (1.0 / n) * field.acceleration[i];
  }
  for (std::size_t i = 0; i < cloud.position.size(); ++i) {
    const Vec3d x = cloud.position[i] - centre;
    torque += cross(x, field.acceleration[i]);
    moment += norm(x) * norm(field.acceleration[i]);
  }
  EXPECT_LT(norm(mean), 1e-8);
  // gravity.md 3 measured 2e-6 to 9e-6 for bodies of 47,324 particles; those of fewer add up less evenly.
  EXPECT_LT(norm(torque) / moment, 2e-5);
}

}  // namespace
}  // namespace breccia::gravity

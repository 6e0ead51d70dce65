// Blocks of elastic matter on walls: slip, stick and Coulomb friction (physics.md 7, sliding block).
#include <gtest/gtest.h>

#include "tests/sim/collision.hpp"
#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {
namespace {

constexpr double kGravity = 10.0;  // [m/s2]

// A soft block, 0.8 x 0.8 x 0.4 m in cells of 0.1 m, that lies on the plane z = 0. Gravity leans by `slope` [rad]
// towards +x, as on an inclined plane. Waves cross the block in 0.03 s.
std::string block_on_plane(double slope, const std::string& kind) {
  char uniform[200];
  std::snprintf(uniform, sizeof uniform, "[gravity]\nuniform = [\"%.17g m/s2\", 0, \"%.17g m/s2\"]\n",
                kGravity * std::sin(slope), -kGravity * std::cos(slope));
  return R"([scene]
end = "10 s"
[grid]
cell = "0.1 m"
[materials.rubber]
tillotson_A = "1 MPa"
tillotson_B = "1 MPa"
shear_modulus = "0.85 MPa"
[[body]]
shape = "box"
size = ["0.8 m", "0.8 m", "0.4 m"]
lattice = "cubic"
spacing = "5 cm"
position = [0, 0, "0.2 m"]
[effects]
gravity = "off"
strength = false
[[boundary]]
normal = [0, 0, 1]
)" + kind +
         "\n" + uniform;
}

struct Motion {
  double time = 0.0;
  Vec3d position{}, velocity{};  // of the centre of mass
};

// At the first t_n from `end` on.
Motion motion_after(const Scene& scene, double end) {
  Motion motion;
  simulate(scene, [&](const TimeLoop& loop) {
    if (loop.time() < end) return true;
    const ParticleOutput p = loop.engine().observe();
    const double share = 1.0 / static_cast<double>(p.size());
    motion.time = loop.time();
    for (std::size_t i = 0; i < p.size(); ++i) {
      motion.position += share * p.position[i];
      motion.velocity += share * p.velocity[i];
    }
    return false;
  });
  return motion;
}

struct Slide {
  double friction, slope;
};
class FrictionPlane : public testing::TestWithParam<Slide> {
 protected:
  [[nodiscard]] static Motion after(double end) {
    const std::string friction = std::to_string(GetParam().friction);
    return motion_after(load(block_on_plane(GetParam().slope, "kind = \"friction\"\nfriction = " + friction)), end);
  }
};

// tan(slope) < mu. Dropping its weight on the plane at t = 0 makes the block bounce for some 0.1 s and slip where it
// has just lifted, by up to g sin(slope) 0.05^2 = 5 mm a few times over; from then on it rests.
class RestingBlock : public FrictionPlane {};
TEST_P(RestingBlock, Rests) {
  const Motion motion = after(1.0);
  EXPECT_LT(std::abs(motion.velocity.x), 0.01);
  EXPECT_LT(motion.position.x, 0.02);
  EXPECT_NEAR(motion.position.z, 0.2, 0.002);
}
INSTANTIATE_TEST_SUITE_P(Slopes, RestingBlock, testing::Values(Slide{0.2, 0.16}, Slide{0.3, 0.24}, Slide{0.5, 0.25}));

// tan(slope) >= 2 mu: every node of the contact slides all the time, so that the friction impulse is mu times the
// impulse of the weight, but for the bounce at the start: mu times a normal speed of 0.05 m/s of 3 m/s.
class SlidingBlock : public FrictionPlane {};
TEST_P(SlidingBlock, Accelerates) {
  const auto [friction, slope] = GetParam();
  const double acceleration = kGravity * (std::sin(slope) - friction * std::cos(slope));
  const Motion motion = after(1.0);
  EXPECT_NEAR(motion.velocity.x, acceleration * motion.time, 0.01 * acceleration);
  EXPECT_NEAR(motion.position.x, 0.5 * acceleration * motion.time * motion.time, 0.005 * acceleration);
}
INSTANTIATE_TEST_SUITE_P(Slopes, SlidingBlock,
                         testing::Values(Slide{0.0, 0.3}, Slide{0.2, 0.4}, Slide{0.3, 0.6}, Slide{0.5, 1.0}));

// A slip plane pushes along its normal alone: along the plane the block falls freely, to the rounding of floats over
// 700 steps.
TEST(SlipPlane, LeavesTheMotionAlongItFree) {
  const double slope = 0.4;
  const Motion motion = motion_after(load(block_on_plane(slope, "kind = \"slip\"")), 1.0);
  EXPECT_NEAR(motion.velocity.x, kGravity * std::sin(slope) * motion.time, 1e-4);
  EXPECT_NEAR(motion.position.z, 0.2, 0.002);
}

// A stick plane holds the block; it sags in shear by rho g sin(slope) h^2/(2 mu) = 1 mm, twice that while it swings.
TEST(StickPlane, HoldsTheBlock) {
  const Motion motion = motion_after(load(block_on_plane(0.4, "kind = \"stick\"")), 1.0);
  EXPECT_LT(std::abs(motion.velocity.x), 0.02);
  EXPECT_LT(std::abs(motion.position.x), 0.002);
}

// Friction planes let go what moves away from them, slip planes hold it back. While it rises, until 0.1 s, the block on
// the friction plane must fly freely.
TEST(Walls, OnlyFrictionPlanesLetGo) {
  const std::vector<std::string> upwards{"body[0].velocity=[0, 0, \"1 m/s\"]"};
  const Motion free = motion_after(load(block_on_plane(0.0, "kind = \"friction\"\nfriction = 1"), upwards), 0.09);
  EXPECT_NEAR(free.position.z, 0.2 + free.time - 0.5 * kGravity * free.time * free.time, 1e-5);
  const Motion held = motion_after(load(block_on_plane(0.0, "kind = \"slip\""), upwards), 0.09);
  EXPECT_LT(held.position.z, 0.22);
}

// The same on a plane across the grid: a ball on a frictionless slope of 3 in 4.
TEST(SlipPlane, MayBeOblique) {
  const Scene scene = load(R"([scene]
end = "10 s"
[grid]
cell = "0.1 m"
[materials.rubber]
tillotson_A = "1 MPa"
tillotson_B = "1 MPa"
shear_modulus = "0.85 MPa"
[[body]]
shape = "sphere"
radius = "0.4 m"
position = ["0.24 m", 0, "0.32 m"]
[effects]
gravity = "off"
strength = false
[[boundary]]
normal = [3, 0, 4]
kind = "slip"
[gravity]
uniform = [0, 0, "-10 m/s2"]
)");
  const Motion motion = motion_after(scene, 1.0);
  const double along = 0.8 * motion.velocity.x - 0.6 * motion.velocity.z;
  const double across = 0.6 * motion.position.x + 0.8 * motion.position.z;
  EXPECT_NEAR(along, 6.0 * motion.time, 1e-4);
  // The ball sits on a few nodes of a staircase and sinks in by a cell at most.
  EXPECT_NEAR(across, 0.4, 0.1);
}

// A ball flies twice through the ends of a period of 1.2 m, whole and in a straight line; no position is ever outside.
class PeriodicAxis : public testing::TestWithParam<int> {};
TEST_P(PeriodicAxis, ContinuesTheMotion) {
  const auto along = [axis = GetParam()](const Vec3d& v) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; };
  const auto vector = [](const char* value) { return from_axis(GetParam(), {value, "0", "0"}); };
  constexpr double kPeriod = 1.2;
  const Scene scene = load(R"([scene]
end = "10 s"
[grid]
cell = "0.1 m"
[[body]]
shape = "sphere"
radius = "0.3 m"
velocity = )" + vector(R"("300 m/s")") +
                           R"([effects]
gravity = "off"
[[boundary]]
kind = "periodic"
point = )" + vector(R"("-0.6 m")") +
                           "normal = " + vector("1") + "[[boundary]]\nkind = \"periodic\"\npoint = " +
                           vector(R"("0.6 m")") + "normal = " + vector("-1"));
  std::vector<Vec3d> start;
  simulate(scene, [&](const TimeLoop& loop) {
    const ParticleOutput p = loop.engine().observe();
    if (start.empty()) {
      start.resize(p.size());
      for (std::size_t i = 0; i < p.size(); ++i) start[p.id[i]] = p.position[i];
    }
    for (std::size_t i = 0; i < p.size(); ++i) {
      EXPECT_GE(along(p.position[i]), -0.5 * kPeriod);
      EXPECT_LT(along(p.position[i]), 0.5 * kPeriod);
      const double path = along(p.position[i]) - along(start[p.id[i]]) - 300.0 * loop.time();
      EXPECT_NEAR(path - kPeriod * std::round(path / kPeriod), 0.0, 1e-5);
    }
    return loop.time() < 8e-3 && !testing::Test::HasFailure();
  });
}

INSTANTIATE_TEST_SUITE_P(Axes, PeriodicAxis, testing::Values(0, 1, 2));

struct Sums {
  double along = 0.0, energy = 0.0, pressure = 0.0;
};

// Of a slab that slides along a periodic axis.
Sums sums_of_slide(int blocks, int axis) {
  const ParticleOutput p = state_after(60, load(periodic_slide(blocks, axis)));
  Sums sums;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec3d v = p.velocity[i];
    sums.along += p.mass[i] * (axis == 0 ? v.x : axis == 1 ? v.y : v.z);
    sums.energy += p.mass[i] * dot(v, v);
    sums.pressure += std::abs(p.pressure[i]);
  }
  return sums;
}

// The same scene turned: nothing but rounding (in double, of 60 steps of a slab that slides) tells along which axis the
// grid repeats. Along z its columns go on beyond the period, along x and y they are found at the other end; one block
// is its own neighbour, five are a stack and a quarter.
TEST(PeriodicPlanes, AreTheSameAlongEveryAxis) {
  for (const int blocks : {1, 2, 5}) {
    const Sums x = sums_of_slide(blocks, 0);
    for (const int axis : {1, 2}) {
      const Sums turned = sums_of_slide(blocks, axis);
      EXPECT_NEAR(turned.along / x.along, 1.0, 1e-10) << blocks << " blocks along axis " << axis;
      EXPECT_NEAR(turned.energy / x.energy, 1.0, 1e-10) << blocks << " blocks along axis " << axis;
      EXPECT_NEAR(turned.pressure / x.pressure, 1.0, 1e-8) << blocks << " blocks along axis " << axis;
    }
  }
}

}  // namespace
}  // namespace breccia::sim::test

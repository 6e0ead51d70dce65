// Bodies of one particle: Kepler orbits, slow drifts, falls in a uniform field.
#include <gtest/gtest.h>

#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {
namespace {

constexpr double kNewton = 6.67430e-11;
constexpr double kMass = 2700.0 * 4.0 / 3.0 * kPi * 50e3 * 50e3 * 50e3;  // 1.413717e18 kg
constexpr double kGravitation = kNewton * 2.0 * kMass;                   // [m3/s2]
constexpr double kSeparation = 200e3;

class OneParticleBodies : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] static bool is_mixed() { return std::string(GetParam()) == "mixed"; }
  [[nodiscard]] static std::vector<std::string> precision() {
    return {std::string("numerics.precision=") + GetParam()};
  }
};

std::string circular_orbit() {
  const double v = 0.5 * std::sqrt(kGravitation / kSeparation);
  const auto body = [&](double side) {
    return "[[body]]\nshape = \"sphere\"\nradius = \"50 km\"\nparticles = 1\nposition = [\"" +
           metres(side * 0.5 * kSeparation) + "\", 0, 0]\nvelocity = [0, \"" + metres(side * v) + "/s\", 0]\n";
  };
  return R"([scene]
end = "1e5 s"
[grid]
cell = "2.5 km"
[time]
step = "0.1220703125 s"
[effects]
gravity = "direct"
[gravity]
interval = 32
softening = 0
)" + body(1.0) +
         body(-1.0);
}

// Relative motion of the two particles.
struct Pair {
  Vec3d r, v;
  explicit Pair(const ParticleOutput& p) {
    const std::size_t first = p.id[0] == 0 ? 0 : 1;
    r = p.position[first] - p.position[1 - first];
    v = p.velocity[first] - p.velocity[1 - first];
  }
  [[nodiscard]] double energy() const { return 0.5 * dot(v, v) - kGravitation / std::sqrt(dot(r, r)); }
  /// Angle ahead of the circular orbit that started on +x [rad].
  [[nodiscard]] double lead(double phase) const {
    return std::atan2(r.y * std::cos(phase) - r.x * std::sin(phase), r.x * std::cos(phase) + r.y * std::sin(phase));
  }
};

// One orbit of 335,000 steps at the step of the flagship run. The leapfrog over windows of h = 3.9 s errs by
// some (omega h)^2 = 3.6e-7 per radian in phase and inside a window in energy. Floats add a random walk: 6e-8 of v per
// step, 3e-5 after the orbit, three times that in the phase: hence 1e-4 and 1e-3 (physics.md 7), which double must beat
// by far.
TEST_P(OneParticleBodies, StayOnAKeplerOrbit) {
  const double period = 2.0 * kPi * std::sqrt(kSeparation * kSeparation * kSeparation / kGravitation);
  ASSERT_NEAR(period, 40909.65, 0.01);
  double energy = 0.0, worst_energy = 0.0, worst_phase = 0.0;
  simulate(load(circular_orbit(), precision()), [&](const TimeLoop& loop) {
    if (loop.step() % 1000 != 0) return true;
    const Pair pair(loop.engine().observe());
    if (loop.step() == 0) energy = pair.energy();
    worst_energy = std::max(worst_energy, std::abs(pair.energy() / energy - 1.0));
    worst_phase = std::max(worst_phase, std::abs(pair.lead(2.0 * kPi * loop.time() / period)));
    return loop.time() < period;
  });
  EXPECT_LT(worst_energy, is_mixed() ? 1e-4 : 1e-6);
  EXPECT_LT(worst_phase, is_mixed() ? 1e-3 : 1e-5);
}

const std::string kLoneParticle = R"([scene]
end = "1e5 s"
[grid]
cell = "2.5 km"
[time]
step = "0.1220703125 s"
[effects]
gravity = "off"
[[body]]
shape = "sphere"
radius = "1 km"
particles = 1
)";

// Where floats for positions would stand still: ulp(2e7 m) = 2 m, one step is 0.12 m. Fixed point rounds by 3e-7 m per
// step and floats by 6e-8 of the velocity, both random: 1e-4 m and, since a velocity error adds up over the run, 0.1 m.
// Double: the position itself is rounded to 4e-9 m in the output, and 1e5 roundings of an offset of 1250 m to 1e-13 m.
TEST_P(OneParticleBodies, DriftSlowlyFarFromTheOrigin) {
  const Scene scene = load(kLoneParticle + R"(position = ["2e7 m", "-2e7 m", 0]
velocity = ["1 m/s", "-1 m/s", "0.1 m/s"]
)",
                           precision());
  const Vec3d start = state_after(0, scene).position[0];
  const Vec3d moved = state_after(100000, scene).position[0] - start;
  const double tolerance = is_mixed() ? 1.0 : 1e-6;
  EXPECT_NEAR(moved.x, 12207.03125, tolerance);
  EXPECT_NEAR(moved.y, -12207.03125, tolerance);
  EXPECT_NEAR(moved.z, 1220.703125, tolerance);
}

// The leapfrog is exact for a constant acceleration: x and v at t_n are those of the parabola. Mixed: 8192 steps round
// a velocity of up to 100 m/s to 4e-6 m/s, at random 4e-4 m/s; 0.4 m after 1000 s.
TEST_P(OneParticleBodies, FallOnAParabola) {
  const Scene scene = load(kLoneParticle + R"(velocity = ["3 m/s", "-20 m/s", "5 m/s"]
[gravity]
uniform = ["0.02 m/s2", "-0.05 m/s2", "0.1 m/s2"]
)",
                           precision());
  const ParticleOutput end = state_after(8192, scene);
  const double t = 1000.0;
  const Vec3d v{3.0, -20.0, 5.0}, g{0.02, -0.05, 0.1};
  const Vec3d dx = end.position[0] - (t * v + 0.5 * t * t * g);
  const Vec3d dv = end.velocity[0] - (v + t * g);
  EXPECT_LT(std::sqrt(dot(dx, dx)), is_mixed() ? 1.0 : 1e-7);
  EXPECT_LT(std::sqrt(dot(dv, dv)), is_mixed() ? 1e-3 : 1e-10);
}

INSTANTIATE_TEST_SUITE_P(Precisions, OneParticleBodies, testing::Values("mixed", "double"));

}  // namespace
}  // namespace breccia::sim::test

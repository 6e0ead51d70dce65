// Two bodies of one particle on a circular Kepler orbit: phase over the length of gravity's windows (physics.md 7).
#include "tests/verification/benchmark.hpp"

namespace breccia::sim::test {
namespace {

constexpr double kSeparation = 200e3;                                                    // [m]
constexpr double kGravitation = 6.67430e-11 * 2.0 * 2700.0 * 4.0 / 3.0 * kPi * 1.25e14;  // 2 G M [m3/s2]

/// How far ahead of the circular orbit the pair is after one period [rad], with windows of `window` seconds.
double lead_after_one_orbit(double window) {
  constexpr int kSteps = 32;
  const double rate = std::sqrt(kGravitation / std::pow(kSeparation, 3));
  const double speed = 0.5 * rate * kSeparation;
  const auto body = [&](double side) {
    return "[[body]]\nshape = \"sphere\"\nradius = \"50 km\"\nparticles = 1\nposition = [\"" +
           metres(side * 0.5 * kSeparation) + "\", 0, 0]\nvelocity = [0, \"" + metres(side * speed) + "/s\", 0]\n";
  };
  const Scene scene =
      load("[scene]\nend = \"1e5 s\"\n[grid]\ncell = \"2.5 km\"\n[time]\nstep = \"" + seconds(window / kSteps) +
           "\"\n[effects]\ngravity = \"direct\"\n[gravity]\ninterval = " + std::to_string(kSteps) +
           "\nsoftening = 0\n[numerics]\nprecision = \"double\"\n" + body(1.0) + body(-1.0));
  double lead = 0.0;
  simulate(scene, [&](const TimeLoop& loop) {
    if (rate * loop.time() < 2.0 * kPi) return true;
    const ParticleOutput p = loop.engine().observe();
    const std::size_t first = p.id[0] == 0 ? 0 : 1;
    const Vec3d r = p.position[first] - p.position[1 - first];
    const double phase = rate * loop.time();
    lead = std::atan2(r.y * std::cos(phase) - r.x * std::sin(phase), r.x * std::cos(phase) + r.y * std::sin(phase));
    return false;
  });
  return lead;
}

// Leapfrog over windows of h is of second order: omega h = 0.077, 0.038, 0.019 here; 1.9 leaves room for the fourth
// order. The last bound is twice what is measured. `resolution` is the number of windows in an orbit.
TEST(Verification, KeplerOrbitIsSecondOrderInTheWindow) {
  const double period = 2.0 * kPi * std::sqrt(std::pow(kSeparation, 3) / kGravitation);
  std::vector<std::pair<double, double>> errors;
  for (const double window : {500.0, 250.0, 125.0}) {
    const double lead = lead_after_one_orbit(window);
    record("Kepler orbit", "phase error [rad]", period / window, lead, 0.0, "exact");
    errors.emplace_back(window, lead);
  }
  EXPECT_GT(observed_order(errors), 1.9);
  EXPECT_LT(std::abs(errors.back().second), 2e-3);
}

}  // namespace
}  // namespace breccia::sim::test

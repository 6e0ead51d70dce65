// An intact elastic sphere switched on from rest under its own gravity: it rings, and settles to Love's solution
// (physics.md 6 and 7).
#include <gtest/gtest.h>

#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {
namespace {

constexpr double kRadius = 50e3;
constexpr double kDensity = 2700.0;
constexpr double kBulk = 2.67e10, kShear = 2.27e10;
constexpr double kPoisson = (3.0 * kBulk - 2.0 * kShear) / (2.0 * (3.0 * kBulk + kShear));
constexpr double kNewton = 6.67430e-11;

// Love: u_r = -c r (s - r^2/R^2) with c = rho g R / (10 (K + 4/3 mu)) and s = (3 - nu)/(1 + nu); P = -K div u.
const double kSurfaceGravity = 4.0 / 3.0 * kPi * kNewton * kDensity * kRadius;
const double kStrainScale = kDensity * kSurfaceGravity * kRadius / (10.0 * (kBulk + 4.0 / 3.0 * kShear));
constexpr double kShapeNumber = (3.0 - kPoisson) / (1.0 + kPoisson);
double exact_pressure(double r) {
  const double q = r / kRadius;
  return kBulk * kStrainScale * (3.0 * kShapeNumber - 5.0 * q * q);
}

std::string sphere(const std::string& precision) {
  return R"([scene]
end = "400 s"
[grid]
cell = "5 km"
[[body]]
shape = "sphere"
radius = "50 km"
[effects]
gravity = "direct"
strength = false
damage = false
[numerics]
precision = ")" +
         precision + "\"\n";
}

class ElasticSphere : public testing::TestWithParam<const char*> {};

// sum m x . v, the rate of the moment of inertia: changes its sign twice per radial oscillation.
double radial_motion(const ParticleOutput& p) {
  double sum = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) sum += p.mass[i] * dot(p.position[i], p.velocity[i]);
  return sum;
}

// Sums over the sphere that compare its state with Love's.
struct Settled {
  double pressure = 0.0, exact_pressure = 0.0;  // inside 0.6 R
  double sinking = 0.0;                         // sum m x . u over sum m x . x
  int samples = 0;

  void add(const ParticleOutput& p, const std::vector<Vec3d>& start) {
    double moved = 0.0;
    double inertia = 0.0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      const Vec3d x = start[p.id[i]];
      const double r = std::sqrt(dot(x, x));
      moved += dot(x, p.position[i] - x);
      inertia += dot(x, x);
      if (r > 0.6 * kRadius) continue;
      pressure += p.pressure[i];
      exact_pressure += test::exact_pressure(r);
    }
    sinking += moved / inertia;
    ++samples;
  }
};

// The period is that of the lowest radial mode, x = 2.398106 with omega R = x c_l (28.52 s). The sphere has 10 cells
// per radius and a surface as rough as a cell, so both the period and the settled pressure are off by a fraction of
// dx/R; measured 1.2 % and 2.5 % here (1.7 % and 3.4 % at 8 cells). Pressure is averaged inside 0.6 R, over the
// particles and over a period and more after q has damped the ringing, and compared with the exact profile at the same
// particles: one particle in the centre is noisy. The mean displacement needs no stress; it counts the rough surface
// most: 3.4 %.
TEST_P(ElasticSphere, RingsAndSettles) {
  const double period = 2.0 * kPi * kRadius / (2.398106 * kLongitudinalSpeed);
  ASSERT_NEAR(period, 28.520, 1e-3);
  ASSERT_NEAR(exact_pressure(0.0), 1.7355e6, 1e2);
  ASSERT_NEAR(-kStrainScale * kRadius * (kShapeNumber - 1.0), -0.636, 1e-3);

  ZeroCrossings crossings;
  Settled settled;
  std::vector<Vec3d> start;
  double ring_period = 0.0;
  const Scene scene = load(sphere(GetParam()));
  simulate(scene, [&](const TimeLoop& loop) {
    const bool ringing = crossings.count() < 7;
    if (!ringing && loop.time() < 300.0) return true;
    const ParticleOutput p = loop.engine().observe();
    if (start.empty()) {
      start.resize(p.size());
      for (std::size_t i = 0; i < p.size(); ++i) start[p.id[i]] = p.position[i];
    }
    if (ringing) {
      crossings.sample(loop.time(), radial_motion(p));
      if (crossings.count() == 7) ring_period = crossings.period();
    } else {
      settled.add(p, start);
    }
    return loop.time() < 340.0;
  });
  EXPECT_NEAR(ring_period, period, 0.02 * period);
  EXPECT_NEAR(settled.pressure, settled.exact_pressure, 0.03 * settled.exact_pressure);
  const double exact_sinking = -kStrainScale * (kShapeNumber - 5.0 / 7.0);
  EXPECT_NEAR(settled.sinking / settled.samples, exact_sinking, 0.05 * -exact_sinking);
}

INSTANTIATE_TEST_SUITE_P(Precisions, ElasticSphere, testing::Values("mixed", "double"));

}  // namespace
}  // namespace breccia::sim::test

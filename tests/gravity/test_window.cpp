// Held gravity at the predicted mid-window position is a leapfrog: two point bodies on a circle keep to it.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "breccia/constants.hpp"
#include "breccia/error.hpp"
#include "gravity/solver.hpp"
#include "gravity/window.hpp"

namespace breccia::gravity {
namespace {

// physics.md 7, Kepler: two bodies of the paper's mass on a circle of four radii.
constexpr double kMass = 1.413717e18;
constexpr double kDistance = 2e5;
constexpr double kStep = 0.1220703125;

struct OrbitErrors {
  double energy;  ///< relative
  double phase;   ///< in orbits, after one orbit
};

struct TwoBodies {
  std::array<Vec3d, 2> position, velocity;

  // Of the relative motion, with v the mean of the half steps around x.
  [[nodiscard]] double energy(Vec3d relative_velocity) const {
    const Vec3d d = position[1] - position[0];
    return 0.5 * dot(relative_velocity, relative_velocity) -
           kGravitationalConstant * 2.0 * kMass / std::sqrt(dot(d, d));
  }
};

std::array<Vec3d, 2> pull(Solver& solver, const TwoBodies& bodies, double prediction_time) {
  std::array<Vec3d, 2> predicted = bodies.position;
  for (std::size_t b = 0; b < 2; ++b) predicted[b] += prediction_time * bodies.velocity[b];
  const std::array<double, 2> mass{kMass, kMass};
  std::array<Vec3d, 2> acceleration{};
  solver.evaluate({predicted, mass}, acceleration, {});
  return acceleration;
}

// One orbit with the engine's leapfrog: x at full steps, v at half steps, the kick dt a held over the window.
// `shift` moves the prediction away from Window's, in steps.
OrbitErrors one_orbit(int interval, double shift) {
  const auto solver = make_solver(GravityMethod::kDirect, {0.0, Precision::kDouble}, mpi::Comm(MPI_COMM_SELF), 1);
  const double speed = std::sqrt(kGravitationalConstant * 2.0 * kMass / kDistance);
  TwoBodies bodies{{{{-0.5 * kDistance, 0, 0}, {0.5 * kDistance, 0, 0}}},
                   {{{0, -0.5 * speed, 0}, {0, 0.5 * speed, 0}}}};
  std::array<Vec3d, 2> acceleration = pull(*solver, bodies, 0.0);
  const double energy_at_start = bodies.energy(bodies.velocity[1] - bodies.velocity[0]);
  for (std::size_t b = 0; b < 2; ++b) bodies.velocity[b] -= 0.5 * kStep * acceleration[b];

  const double period = 2.0 * kPi * kDistance / speed;
  const int steps = static_cast<int>(period / kStep);
  Window window(interval);
  OrbitErrors errors{};
  for (int step = 0; step < steps; ++step) {
    if (window.due()) acceleration = pull(*solver, bodies, window.prediction_time(kStep) + shift * kStep);
    const auto before = bodies.velocity;
    for (std::size_t b = 0; b < 2; ++b) bodies.velocity[b] += kStep * acceleration[b];
    const Vec3d v = 0.5 * ((bodies.velocity[1] + before[1]) - (bodies.velocity[0] + before[0]));
    if (window.due()) errors.energy = std::max(errors.energy, std::abs(bodies.energy(v) / energy_at_start - 1.0));
    for (std::size_t b = 0; b < 2; ++b) bodies.position[b] += kStep * bodies.velocity[b];
    window.advance();
  }
  const Vec3d d = bodies.position[1] - bodies.position[0];
  const double expected = 2.0 * kPi * (steps * kStep / period - 1.0);
  errors.phase = std::abs(std::atan2(d.y, d.x) - expected) / (2.0 * kPi);
  return errors;
}

TEST(Window, CircularOrbitKeepsEnergyAndPhase) {
  const OrbitErrors errors = one_orbit(32, 0.0);
  // gravity.md 4 measured 3e-9 on a tighter orbit for longer; physics.md 7 asks 1e-4 and 1e-3.
  EXPECT_LT(errors.energy, 1e-7);
  EXPECT_LT(errors.phase, 1e-6);
}

TEST(Window, PredictionBySixteenStepsWouldBeSeen) {
  const OrbitErrors right = one_orbit(32, 0.0);
  const OrbitErrors half_a_step_late = one_orbit(32, 0.5);
  EXPECT_GT(half_a_step_late.energy, 100.0 * right.energy);
}

// The leapfrog with step K dt: four times the phase error for twice the interval.
TEST(Window, PhaseErrorIsSecondOrderInTheInterval) {
  const double coarse = one_orbit(512, 0.0).phase;
  const double fine = one_orbit(256, 0.0).phase;
  EXPECT_NEAR(coarse / fine, 4.0, 0.4);
}

TEST(Window, EveryStepNeedsNoPrediction) {
  EXPECT_EQ(Window(1).prediction_time(kStep), 0.0);
  EXPECT_DOUBLE_EQ(Window(32).prediction_time(kStep), 15.5 * kStep);
}

// physics.md 8, case 19: a run restarted at any step evaluates at the same steps.
TEST(Window, PhaseSurvivesARestart) {
  Window whole(5);
  for (int step = 0; step < 23; ++step) {
    const Window restarted(whole.interval(), whole.phase());
    EXPECT_EQ(restarted.due(), step % 5 == 0);
    whole.advance();
  }
}

TEST(Window, RefusesImpossibleIntervalsAndPhases) {
  EXPECT_THROW(Window(0), UsageError);
  EXPECT_THROW(Window(32, 32), UsageError);
  EXPECT_THROW(Window(32, -1), UsageError);
}

}  // namespace
}  // namespace breccia::gravity

// Bodies on orbits under held gravity, for each method (gravity.md 6.5 and 6.6).
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "gravity/solver.hpp"
#include "gravity/window.hpp"
#include "plain_sum.hpp"

namespace breccia::gravity {
namespace {

constexpr double kBodyMass = 1.413717e18;
constexpr double kStep = 0.1220703125;
constexpr double kPull = 2.0 * kGravitationalConstant * kBodyMass;  // of the relative motion [m3/s2]

double norm(Vec3d v) { return std::sqrt(dot(v, v)); }

struct State {
  Vec3d position, velocity;  // of body 1 relative to body 0

  [[nodiscard]] double energy() const { return 0.5 * dot(velocity, velocity) - kPull / norm(position); }
  // What drift-kick-drift with a step of D conserves but for D^4: H + D^2 (|grad V|^2/12 - v.V''v/24).
  [[nodiscard]] double energy_of_leapfrog(double interval) const {
    const double r2 = dot(position, position);
    const double along = dot(position, velocity);
    const double stiffness = kPull / std::pow(r2, 1.5) * (dot(velocity, velocity) - 3.0 * along * along / r2);
    return energy() + interval * interval * (kPull * kPull / (12.0 * r2 * r2) - stiffness / 24.0);
  }
  [[nodiscard]] double spin() const { return norm(cross(position, velocity)); }
};

// At either end of the ellipse, the first named.
State start(double from, double to) {
  const double axis = 0.5 * (from + to);
  return {{from, 0, 0}, {0, std::sqrt(kPull * (2.0 / from - 1.0 / axis)), 0}};
}

// Position at `time` after leaving that end, by Kepler's equation.
Vec3d kepler(double from, double to, double time) {
  const double axis = 0.5 * (from + to);
  const double e = (to - from) / (to + from);
  const double anomaly = std::fmod(std::sqrt(kPull / (axis * axis * axis)) * time, 2.0 * kPi);
  double eccentric = anomaly;
  for (int k = 0; k < 50; ++k)
    eccentric -= (eccentric - e * std::sin(eccentric) - anomaly) / (1 - e * std::cos(eccentric));
  return {axis * (std::cos(eccentric) - e), axis * std::sqrt(1 - e * e) * std::sin(eccentric), 0};
}

// Two rigid bodies of equal mass and the engine's leapfrog: x at full steps, v at half steps, the kick held over the
// window. Each body is moved by its mean acceleration.
class Orbit {
 public:
  Orbit(Solver& solver, const Cloud& body, const State& state, int interval)
      : solver_(solver), body_(body), window_(interval), x_{-0.5 * state.position, 0.5 * state.position} {
    v_ = {-0.5 * state.velocity, 0.5 * state.velocity};
    a_ = pull(window_.prediction_time(kStep));
    for (std::size_t b = 0; b < 2; ++b) v_[b] -= 0.5 * kStep * a_[b];
  }

  void step() {
    if (window_.due()) a_ = pull(window_.prediction_time(kStep));
    for (std::size_t b = 0; b < 2; ++b) v_[b] += kStep * a_[b];
    for (std::size_t b = 0; b < 2; ++b) x_[b] += kStep * v_[b];
    window_.advance();
  }
  // At the end of a window; the half kick from v_ to the time of the positions is that of the window.
  [[nodiscard]] State state() const { return {x_[1] - x_[0], v_[1] - v_[0] + 0.5 * kStep * (a_[1] - a_[0])}; }
  // Half a step before, where the drift-kick-drift of a window ends: its kicks are half a step ahead of the velocities.
  [[nodiscard]] State state_of_leapfrog() const {
    return {x_[1] - x_[0] - 0.5 * kStep * (v_[1] - v_[0]), v_[1] - v_[0]};
  }
  [[nodiscard]] Vec3d separation() const { return x_[1] - x_[0]; }

 private:
  std::array<Vec3d, 2> pull(double prediction_time) {
    Cloud cloud;
    for (std::size_t b = 0; b < 2; ++b) {
      for (const Vec3d& p : body_.position) cloud.position.push_back(x_[b] + prediction_time * v_[b] + p);
      cloud.mass.insert(cloud.mass.end(), body_.mass.begin(), body_.mass.end());
    }
    std::vector<Vec3d> field(cloud.position.size());
    solver_.evaluate({cloud.position, cloud.mass}, field, {});
    std::array<Vec3d, 2> mean{};
    const std::size_t n = body_.position.size();
    for (std::size_t i = 0; i < field.size(); ++i) mean[i / n] += (body_.mass[i % n] / kBodyMass) * field[i];
    return mean;
  }

  Solver& solver_;
  const Cloud& body_;
  Window window_;
  std::array<Vec3d, 2> x_, v_{}, a_{};
};

struct Drift {
  double energy, spin, position;
  double leapfrog = 0.0;  // largest change of its own energy at any time
};

Drift after_1e5_seconds(GravityMethod method, double from, double to, int interval) {
  const auto solver = make_solver(method, {.precision = Precision::kDouble}, mpi::Comm(MPI_COMM_SELF), 1);
  const Cloud point{{Vec3d{}}, {kBodyMass}};
  const State first = start(from, to);
  Orbit orbit(*solver, point, first, interval);
  const double axis = 0.5 * (from + to);
  const double period = 2.0 * kPi * std::sqrt(axis * axis * axis / kPull);
  const int steps = static_cast<int>(std::ceil(1e5 / period) * period / kStep) / interval * interval;
  const double window = interval * kStep;
  const double leapfrog_at_start = orbit.state_of_leapfrog().energy_of_leapfrog(window);
  double leapfrog = 0.0;
  for (int k = 1; k <= steps; ++k) {
    orbit.step();
    if (k % interval > 0) continue;
    const double now = orbit.state_of_leapfrog().energy_of_leapfrog(window);
    leapfrog = std::max(leapfrog, std::abs(now / leapfrog_at_start - 1.0));
  }
  const State last = orbit.state();
  return {std::abs(last.energy() / first.energy() - 1.0), std::abs(last.spin() / first.spin() - 1.0),
          norm(last.position - kepler(from, to, steps * kStep)), leapfrog};
}

// What a leapfrog conserves is not the energy but a function next to it, which here changes by less than 1e-9 all
// along; the energy itself swings about it with the distance, by 3e-7 on the ellipse, so it is compared after whole
// orbits, at apocentre. gravity.md 4 measured 3e-9 and 4 m on the circle, 1.4e-8 and 0.5 m on the ellipse; 6.5 asks for
// 1e-7 and 50 m.
TEST(Orbit, TwoPointsKeepTheirOrbitFor1e5Seconds) {
  for (const GravityMethod method : {GravityMethod::kDirect, GravityMethod::kTree, GravityMethod::kTreePm}) {
    for (const auto [from, to] : {std::array{1e5, 1e5}, std::array{4e5, 1.1e5}}) {
      const Drift drift = after_1e5_seconds(method, from, to, 32);
      SCOPED_TRACE(testing::Message() << "method " << static_cast<int>(method) << ", from " << from << " m");
      EXPECT_LT(drift.energy, 1e-7);
      EXPECT_LT(drift.leapfrog, 1e-9);
      EXPECT_LT(drift.spin, 1e-7);
      EXPECT_LT(drift.position, 50.0);
    }
  }
}

TEST(Orbit, PositionErrorIsSecondOrderInTheInterval) {
  const auto error = [](int interval) {
    return after_1e5_seconds(GravityMethod::kDirect, 1e5, 1e5, interval).position;
  };
  const double fine = error(64), coarse = error(128);
  EXPECT_NEAR(std::log2(coarse / fine), 2.0, 0.15);
}

// gravity.md 6.6: spheres pull each other as points, but for their granularity.
TEST(Orbit, RigidSpheresFollowThePointsThroughOneOrbit) {
  Cloud sphere;
  std::mt19937_64 random(3);
  add_rock(sphere, 1050, {}, 5e4, random);
  Vec3d centre{};
  for (const Vec3d& p : sphere.position) centre += (1.0 / static_cast<double>(sphere.position.size())) * p;
  for (Vec3d& p : sphere.position) p = p - centre;
  sphere.mass.assign(sphere.position.size(), kBodyMass / static_cast<double>(sphere.position.size()));
  // A kick every 62 s: gravity.md 4 finds 1.1 km in 1e5 s at half the distance, a few 1e-4 of an orbit.
  constexpr int kInterval = 512;
  constexpr double kDistance = 2e5;
  const double period = 2.0 * kPi * std::sqrt(kDistance * kDistance * kDistance / kPull);
  for (const GravityMethod method : {GravityMethod::kTree, GravityMethod::kTreePm}) {
    const auto solver = make_solver(method, {.softening = 500.0}, mpi::Comm(MPI_COMM_SELF), 1);
    Orbit orbit(*solver, sphere, start(kDistance, kDistance), kInterval);
    const int steps = static_cast<int>(period / kStep);
    for (int k = 0; k < steps; ++k) orbit.step();
    const Vec3d should = kepler(kDistance, kDistance, steps * kStep);
    const Vec3d is = orbit.separation();
    const double angle = std::atan2(cross(should, is).z, dot(should, is));
    EXPECT_LT(std::abs(angle) / (2.0 * kPi), 1e-3) << "method " << static_cast<int>(method);
    EXPECT_NEAR(norm(is) / kDistance, 1.0, 1e-3);
  }
}

}  // namespace
}  // namespace breccia::gravity

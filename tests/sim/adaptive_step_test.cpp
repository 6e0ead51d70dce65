// Steps chosen by the stability limit: changed at window starts, shortened inside a window by shocks only; second
// order, stable (physics.md 5).
#include <gtest/gtest.h>

#include <optional>

#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {
namespace {

// Two soft balls at a fifth of their sound speed: compression and particle speeds change the limit all the time.
const std::string kSoftCollision = R"([scene]
end = "1 s"
[grid]
cell = "0.1 m"
[materials.rubber]
tillotson_A = "1 MPa"
tillotson_B = "1 MPa"
shear_modulus = "0.85 MPa"
[[body]]
shape = "sphere"
radius = "0.4 m"
position = ["-0.5 m", 0, 0]
velocity = ["6 m/s", 0, 0]
[[body]]
shape = "sphere"
radius = "0.4 m"
position = ["0.5 m", "0.1 m", 0]
velocity = ["-6 m/s", 0, 0]
[effects]
gravity = "off"
strength = false
[gravity]
interval = 8
)";

class AdaptiveStep : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] static std::string precision() { return std::string("numerics.precision=") + GetParam(); }
};

// At a window start the step is cfl times the limit, but for the half of the work that the stress adds to the energy
// after the choice, 0.3 % of the sound speed here. What 8 steps bring must fit into the margin that cfl = 0.4 leaves.
TEST_P(AdaptiveStep, FollowsTheLimitAtWindowStarts) {
  const Scene scene = load(kSoftCollision, {precision()});
  double dt = 0.0, smallest = HUGE_VAL, largest = 0.0;
  simulate(scene, [&](const TimeLoop& loop) {
    const double limit = stable_step(scene, loop.engine().signal_speeds(), true).seconds / scene.time.cfl;
    if (loop.step() % 8 == 0) {
      dt = loop.dt();
      EXPECT_NEAR(dt, 0.4 * limit, 0.01 * limit) << "step " << loop.step();
    }
    EXPECT_EQ(loop.dt(), dt) << "step " << loop.step();  // too mild a change to shorten it
    EXPECT_LT(dt, 0.6 * limit) << "step " << loop.step();
    smallest = std::min(smallest, dt);
    largest = std::max(largest, dt);
    return loop.time() < 0.15;
  });
  EXPECT_GT(largest, 1.2 * smallest);
}

// Balls that meet at 1.8 times their sound speed within one window: compression and heat raise the sound speed and the
// viscosity many times over before the next. Held through the window the first step breaks the run within a few; the
// limit is looked at whenever particles are sorted, which is at every step or two at such speeds. What a step that
// stands unchanged may come to in between is less than the limit itself.
TEST_P(AdaptiveStep, IsShortenedByAShockInsideAWindow) {
  const Scene scene =
      load(kSoftCollision, {precision(), "gravity.interval=256", "numerics.sort_interval=64",
                            "body[0].velocity=[\"25 m/s\", 0, 0]", "body[1].velocity=[\"-25 m/s\", 0, 0]"});
  std::optional<Budget> budget;
  double first_dt = 0.0, dt = HUGE_VAL, kinetic = 0.0, gained = 0.0;
  simulate(scene, [&](const TimeLoop& loop) {
    const double limit = stable_step(scene, loop.engine().signal_speeds(), true).seconds / scene.time.cfl;
    EXPECT_LT(loop.dt(), limit) << "step " << loop.step();
    EXPECT_LE(loop.dt(), dt) << "grows inside a window, step " << loop.step();
    if (!budget) budget.emplace(nullptr, scene, mpi::Comm(MPI_COMM_SELF));
    const io::DiagnosticsRow row = budget->row(loop.engine(), loop.engine().observe(), loop.lost_work());
    if (loop.step() == 0) first_dt = loop.dt(), kinetic = row.kinetic_energy;
    dt = loop.dt();
    gained = std::max(gained, row.energy_residual);
    return loop.step() < 255 && loop.time() < 0.05;
  });
  EXPECT_LT(dt, 0.5 * first_dt);
  EXPECT_LT(gained, 1e-3 * kinetic);
}

// Kinetic energy and budget after a gentler collision, of the kinetic energy before it.
struct Energies {
  double kinetic, residual;
};
Energies energies(const std::string& precision, const std::string& cfl) {
  const Scene scene = load(
      kSoftCollision, {precision, cfl, "body[0].velocity=[\"1 m/s\", 0, 0]", "body[1].velocity=[\"-1 m/s\", 0, 0]"});
  std::optional<Budget> budget;
  io::DiagnosticsRow first, row;
  simulate(scene, [&](const TimeLoop& loop) {
    const bool last = loop.time() >= 0.35;
    if (loop.step() > 0 && !last) return true;
    if (!budget) budget.emplace(nullptr, scene, mpi::Comm(MPI_COMM_SELF));
    row = budget->row(loop.engine(), loop.engine().observe(), loop.lost_work());
    if (loop.step() == 0) first = row;
    return !last;
  });
  return {row.kinetic_energy / first.kinetic_energy, row.energy_residual / first.kinetic_energy};
}

// On four cells per radius the transfer smooths away a quarter of the energy of the bounce. It may only lose energy,
// and what it loses is a matter of the grid and hardly of the step; an unstable step gains energy without bound.
TEST_P(AdaptiveStep, KeepsTheEnergyOfSmallerSteps) {
  const Energies chosen = energies(precision(), "time.cfl=0.4");
  const Energies fine = energies(precision(), "time.cfl=0.1");
  EXPECT_LT(chosen.residual, 0.0);
  EXPECT_NEAR(chosen.residual, fine.residual, 0.05);
  EXPECT_NEAR(chosen.kinetic, fine.kinetic, 0.05);
}

// A leapfrog that kicks with the mean of two steps is exact for a constant acceleration whatever the steps: positions
// stay on the parabola. The body falls faster than its own sound, so that the step is dx/|v| and shrinks all the time.
// Observed velocities are means of v^{n-1/2} and v^{n+1/2}, which belongs to a quarter of the change of step after t_n.
// Mixed: speeds of 400 m/s round to 1.5e-5 m/s, 1e4 times at random: 1.5e-3 m/s and in 20 s 0.03 m.
TEST_P(AdaptiveStep, KeepsAFallOnItsParabola) {
  const Scene scene = load(R"([scene]
end = "100 s"
[grid]
cell = "1 m"
[materials.soft]
tillotson_A = "10 kPa"
tillotson_B = "10 kPa"
shear_modulus = 0
[[body]]
shape = "sphere"
radius = "0.3 m"
particles = 1
velocity = ["30 m/s", 0, 0]
[effects]
gravity = "off"
[gravity]
interval = 4
uniform = ["20 m/s2", 0, "-3 m/s2"]
)",
                           {precision()});
  const bool mixed = std::string(GetParam()) == "mixed";
  const double tolerance = mixed ? 0.05 : 1e-9;
  const double speed_tolerance = mixed ? 5e-3 : 1e-9;
  double first_step = 0.0, dt = 0.0;
  simulate(scene, [&](const TimeLoop& loop) {
    const ParticleOutput p = loop.engine().observe();
    if (loop.step() == 0) first_step = dt = loop.dt();
    const double t = loop.time();
    const double seen = t + 0.25 * (loop.dt() - dt);
    dt = loop.dt();
    EXPECT_NEAR(p.position[0].x, 30.0 * t + 10.0 * t * t, tolerance) << "t = " << t;
    EXPECT_NEAR(p.position[0].z, -1.5 * t * t, tolerance) << "t = " << t;
    EXPECT_NEAR(p.velocity[0].x, 30.0 + 20.0 * seen, speed_tolerance) << "t = " << t;
    return t < 20.0;
  });
  EXPECT_LT(dt, 0.1 * first_step);
}

// From rest nothing tells how far particles will have moved before the next sorting but the field they fall in: 25
// cells in the 100 steps that numerics.sort_interval allows here. Two balls, so that the grid is used. Mixed:
// velocities up to 100 m/s round to 4e-6 m/s.
TEST_P(AdaptiveStep, SortsOftenEnoughForAFallFromRest) {
  const Scene scene =
      load(kSoftCollision, {precision(), "grid.cell=\"0.2 m\"", "time.step=\"1 ms\"", "numerics.sort_interval=100",
                            "gravity.interval=200", "gravity.uniform=[0, 0, \"1000 m/s2\"]",
                            "body[0].velocity=[0, 0, 0]", "body[1].velocity=[0, 0, 0]"});
  simulate(scene, [&](const TimeLoop& loop) {
    if (loop.step() < 100) return true;
    const ParticleOutput p = loop.engine().observe();
    double height = 0.0;
    for (std::size_t i = 0; i < p.size(); ++i) height += p.position[i].z / static_cast<double>(p.size());
    EXPECT_NEAR(height, 0.5 * 1000.0 * loop.time() * loop.time(), 1e-3);
    return false;
  });
}

INSTANTIATE_TEST_SUITE_P(Precisions, AdaptiveStep, testing::Values("mixed", "double"));

}  // namespace
}  // namespace breccia::sim::test

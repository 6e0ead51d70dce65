// Matter that falls through a periodic box: the field has no potential there, and the budget closes all the same.
#include <gtest/gtest.h>

#include <optional>

#include "sim/diagnostics.hpp"
#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {
namespace {

// A block of 0.4 m and a few grains beside it that need no grid, in a period of 1.6 m along y that begins at -1.2 m:
// nodes repeat from 0 on, positions from there. The field leans towards x, which does not repeat.
std::string falling_block(const std::string& precision) {
  return R"([scene]
end = "10 s"
[grid]
cell = "0.1 m"
[time]
step = "1 ms"
[materials.rubber]
tillotson_A = "1 MPa"
tillotson_B = "1 MPa"
shear_modulus = "0.85 MPa"
[[body]]
shape = "box"
material = "rubber"
size = ["0.4 m", "0.4 m", "0.4 m"]
lattice = "cubic"
spacing = "5 cm"
[[body]]
shape = "sphere"
material = "rubber"
radius = "0.4 m"
spacing = "0.55 m"
position = ["1.5 m", "-0.5 m", "0 m"]
[effects]
gravity = "off"
strength = false
[gravity]
uniform = ["20 m/s2", "-100 m/s2", 0]
interval = 8
[[boundary]]
point = [0, "-1.2 m", 0]
normal = [0, 1, 0]
kind = "periodic"
[[boundary]]
point = [0, "0.4 m", 0]
normal = [0, -1, 0]
kind = "periodic"
[numerics]
precision = ")" +
         precision + "\"\n";
}

struct Fall {
  io::DiagnosticsRow start, end;
  double residual = 0.0;  // largest
  double shown = 0.0;     // potential at the start, of the positions of the snapshots
};

double potential_of(const ParticleOutput& p) {
  double potential = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i)
    potential -= p.mass[i] * (20.0 * p.position[i].x - 100.0 * p.position[i].y);
  return potential;
}

constexpr std::uint64_t kHalf = 160, kEnd = 320;

// Looks at the budget at every fifth step until kEnd; the particles cross the end of the period in between.
TimeLoop::Visit watch(Fall& fall, Budget& budget, const mpi::Comm& comm) {
  return [&](const TimeLoop& loop) {
    if (loop.step() % 5 != 0) return true;
    const ParticleOutput particles = loop.engine().observe();
    io::DiagnosticsRow row = budget.row(loop.engine(), particles, loop.lost_work());
    row.time = loop.time();
    if (loop.step() == 0) {
      fall.start = row;
      fall.shown = comm.sum(potential_of(particles));
    }
    fall.end = row;
    fall.residual = std::max(fall.residual, std::abs(row.energy_residual));
    return loop.step() < kEnd;
  };
}

class PeriodicField : public testing::TestWithParam<const char*> {};

// In free fall leapfrog keeps the energy exactly. What is left is rounding, in double of 320 kicks. In mixed precision
// a kick of 0.1 m/s on 32 m/s is rounded by up to 1e-6 m/s, 1e-5 of itself, and mostly to the same side. A period that
// was not counted would miss m g L, a third of the energy here.
TEST_P(PeriodicField, EnergyOfAFallThroughPeriodsStays) {
  const mpi::Comm comm;
  const Scene scene = load(falling_block(GetParam()));
  const ResolvedEffects effects = resolve_effects(scene);
  const double bound = std::string(GetParam()) == "mixed" ? 1e-5 : 1e-12;

  Fall fall;
  RunState saved;
  EngineState engine;
  Budget budget(nullptr, scene, comm);
  TimeLoop loop(scene, effects, 1, comm);
  loop.run(watch(fall, budget, comm), [&](const TimeLoop& now) {
    if (now.step() != kHalf) return true;
    engine = now.engine().save();
    saved = run_state_from(to_text({now.state(), budget.state(), {}, {}}));
    return true;
  });
  EXPECT_NEAR(fall.start.gravitational_energy, fall.shown, 1e-12 * std::abs(fall.shown));
  // 1/2 g t^2, more than three periods.
  const double depth = 0.5 * std::hypot(20.0, 100.0) * fall.end.time * fall.end.time;
  EXPECT_GT(depth, 3.0 * 1.6);
  EXPECT_NEAR(fall.end.gravitational_energy - fall.start.gravitational_energy,
              -fall.end.mass * std::hypot(20.0, 100.0) * depth, bound * fall.end.kinetic_energy);
  EXPECT_LT(fall.residual, bound * fall.end.kinetic_energy);

  // The same from a checkpoint on, to the last bit.
  Fall second;
  Budget carried(nullptr, scene, comm);
  carried.restore(saved.budget);
  TimeLoop rest(scene, effects, engine, saved.loop, 1, comm);
  rest.run(watch(second, carried, comm));
  EXPECT_EQ(second.end.gravitational_energy, fall.end.gravitational_energy);
  EXPECT_EQ(second.end.energy_residual, fall.end.energy_residual);
}

INSTANTIATE_TEST_SUITE_P(Precisions, PeriodicField, testing::Values("mixed", "double"));

}  // namespace
}  // namespace breccia::sim::test

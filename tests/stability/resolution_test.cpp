// Resolutions nobody would choose: particles per cell, cells 100 times too large or small, bodies far too fast.
#include "tests/stability/hard_scene.hpp"

namespace breccia::sim::test {
namespace {

class Resolution : public Hard {};

// Particles per cell of the close-packed lattice are sqrt(2) (cell/spacing)^3.
std::string spacing(double cell, double per_cell) {
  return "\"" + metres(cell * std::cbrt(std::sqrt(2.0) / per_cell)) + "\"";
}

// What a collision may do with energy: ASFLIP smooths velocities away without heating. Nothing may come from nowhere:
// 1e-3 of the kinetic energy at the start, as in sim_conservation.
void expect_no_gain(const Course& course) {
  EXPECT_LT(course.gained, 1e-3 * course.largest_kinetic);
  EXPECT_LT(course.largest_kinetic, 1.001 * course.first.kinetic_energy);
}

// Danger: half-empty grids (0.5 per cell: holes, nodes of one particle) and crowded cells (64: tiles of many packs).
// Through a collision of 200 m/s.
TEST_P(Resolution, HalfAParticleToSixtyFourPerCell) {
  struct Case {
    double cell, per_cell;
  };
  for (const auto& [cell, per_cell] : {Case{10e3, 0.5}, Case{25e3, 64.0}}) {
    const std::string per = spacing(cell, per_cell);
    const Scene dense = scene(two_spheres(cell, 200.0, cell, 20e3),
                              {"effects.gravity=off", "body[0].spacing=" + per, "body[1].spacing=" + per});
    const Course course = follow(dense, {.time = 2.0 * cell / 200.0 + 100.0});
    expect_kept(dense, course);
    expect_no_gain(course);
    EXPECT_LT(course.last.kinetic_energy, 0.9 * course.first.kinetic_energy) << "they did not meet";
  }
}

// A grid 100 times too coarse for a body of 500 particles: 1000 km cells over spheres of 100 km. They share their nodes
// from the start and move as one with the mean velocity, here zero.
TEST_P(Resolution, CellsAHundredTimesTooLarge) {
  const Scene coarse = scene(two_spheres(1000e3, 200.0, 10e3, 0.0),
                             {"effects.gravity=off", "body[0].spacing=\"10 km\"", "body[1].spacing=\"10 km\""});
  const Course course = follow(coarse, {.steps = 200});
  expect_kept(coarse, course);
  expect_no_gain(course);
}

// A grid 100 times too fine, 100 m for particles 10 km apart: every particle is alone, nothing holds the bodies
// together, and each flies on its straight line through the other body. Near the cut between ranks nobody knows who is
// alone and nodes are used: C = 1e-7 of 100 m/s per cell, 5e-5 of volume per step at random.
TEST_P(Resolution, CellsAHundredTimesTooSmall) {
  const Scene fine = scene(two_spheres(100.0, 200.0, 10e3, 0.0),
                           {"effects.gravity=off", "body[0].spacing=\"10 km\"", "body[1].spacing=\"10 km\""});
  const Course course = follow(fine, {.steps = 500, .every = 100});
  expect_kept(fine, course);
  EXPECT_NEAR(course.last.kinetic_energy, course.first.kinetic_energy, 1e-5 * course.first.kinetic_energy);
  EXPECT_NEAR(course.last.max_J, 1.0, 1e-4);
}

// 5 km/s, beyond any use of the material model (vapour starts at E_iv = 4.7 MJ/kg): shocks of 50 GPa and J = 0.64 after
// Hugoniot, which four cells per radius overshoot to 0.28. Sorting must keep up with particles that cross a cell in a
// few steps, Tillotson stay finite in its mixed branch, and no J come near the floor of a tenth per step.
TEST_P(Resolution, FiveKilometresPerSecond) {
  const Scene fast = scene(two_spheres(12.5e3, 5000.0, 12.5e3, 25e3), {"effects.gravity=off"});
  const Course course = follow(fast, {.time = 60.0});
  expect_kept(fast, course);
  expect_no_gain(course);
  EXPECT_GT(course.min_J, 0.1);
  EXPECT_GT(course.last.internal_energy, 0.05 * course.first.kinetic_energy);
  EXPECT_LT(course.lost, 0.5 * course.first.kinetic_energy);
}

INSTANTIATE_TEST_SUITE_P(Precisions, Resolution, testing::Values("mixed", "double"));

}  // namespace
}  // namespace breccia::sim::test

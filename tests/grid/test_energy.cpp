// Where the energy of a step goes: the budget of the plain step, which the engine equals (test_reference.cpp).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "grid/reference_step.hpp"
#include "scene/bodies.hpp"
#include "tests/support/flaws.hpp"

namespace breccia::grid {
namespace {

// Two spheres of rubble, three cells in radius, that strike each other at 300 m/s and spin: all is surface, most cells
// are half empty, and a tenth of the motion becomes heat within 40 steps.
Scene rubble() {
  Scene scene;
  scene.cell = 8e3;
  scene.materials.resize(1);
  for (int b = 0; b < 2; ++b) {
    BodyParameters body;
    body.semi_axes = {25e3, 25e3, 25e3};
    body.particles = 180;
    body.first_id = static_cast<std::uint64_t>(b) * 180;
    body.position = {b == 0 ? 26e3 : -26e3, b == 0 ? 5e3 : -5e3, 1e3 * b};
    body.velocity = {b == 0 ? -150.0 : 150.0, 10.0, -3.0};
    body.mass = 4.0 / 3.0 * 3.141592653589793 * 25e3 * 25e3 * 25e3 * 2700.0;
    body.damage = 1.0;
    scene.bodies.push_back(body);
  }
  return scene;
}

// Kinetic energy of the particles and internal energy, at a half step [J].
struct Energy {
  double kinetic = 0.0, internal = 0.0;
};
Energy energy_of(const test::ReferenceStep& step) {
  Energy e;
  for (const test::ReferenceParticle& p : step.particles()) {
    e.kinetic += 0.5 * p.mass * dot(p.v, p.v);
    e.internal += p.mass * p.state.energy.value();
  }
  return e;
}

// The heat is -f.v of the nodes, v = v_p's part + C's part, but the motion only loses f.(v_p's part): the difference,
// EnergyTerms::affine, is all that a run without outer forces can gain beyond rounding, but for the exchange of
// `gradient`. It vanishes where mass surrounds a node evenly. The sums have 1e4 terms a step: 1e-12 of the energy.
TEST(EnergyOfAStep, IsKeptButForFourNamedTerms) {
  const Scene scene = rubble();
  const ParticleArrays all = scene::make_particles(scene, mpi::Comm(MPI_COMM_SELF));
  test::ReferenceSetup setup;
  setup.cell = scene.cell;
  setup.effects = {.damage = false, .fully_damaged = true};
  setup.material = scene.materials[0];
  setup.spin = {1e-3, -2e-3, 1.5e-3};
  test::ReferenceStep step(setup, all, test::flaws_of(scene, all));
  const Energy first = energy_of(step);
  double worst = 0.0;
  for (int n = 0; n < 40; ++n) {
    step.step(0.5);
    const Energy now = energy_of(step);
    const double gained = now.kinetic + now.internal - first.kinetic - first.internal;
    worst = std::max(worst, std::abs(gained - step.energy_terms().sum()) / first.kinetic);
    EXPECT_LE(step.energy_terms().filter, 0.0);
  }
  const test::EnergyTerms& terms = step.energy_terms();
  const Energy last = energy_of(step);
  EXPECT_LT(worst, 1e-12);
  EXPECT_GT(last.internal, 0.1 * first.kinetic);
  EXPECT_GT(std::abs(terms.affine), 1e-3 * first.kinetic);
}

}  // namespace
}  // namespace breccia::grid

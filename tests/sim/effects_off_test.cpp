// An effect that is off does nothing and costs nothing.
#include <gtest/gtest.h>

#include "grid/particles.hpp"
#include "tests/sim/collision.hpp"

namespace breccia::sim::test {
namespace {

const std::vector<std::string> kEverythingOff{"effects.gravity=off",     "effects.shear=false",
                                              "effects.strength=false",  "effects.damage=false",
                                              "effects.viscosity=false", "effects.energy=false"};

class EffectsOff : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] static bool is_mixed() { return std::string(GetParam()) == "mixed"; }
  [[nodiscard]] static Scene scene(const std::string& text, std::vector<std::string> overrides) {
    overrides.push_back(std::string("numerics.precision=") + GetParam());
    return load(text, overrides);
  }
};

// Nothing acts on a body in flight: every particle keeps its velocity and its volume. 500 steps round a velocity of
// 230 m/s by 1e-5 m/s, at random or, as weights whose sum is not quite 1, always the same way: 2e-4 to 5e-3 m/s, and
// 0.02 to 0.5 m in 200 s. In double 1e-9 of that. J follows C, 1e-7 of 230 m/s per cell: 1e-9 per step.
TEST_P(EffectsOff, ABodyFliesStraight) {
  const Scene sphere = scene(R"([scene]
end = "1e4 s"
[grid]
cell = "10 km"
[time]
step = "0.4 s"
[[body]]
shape = "sphere"
radius = "50 km"
velocity = ["200 m/s", "-100 m/s", "50 m/s"]
)",
                             kEverythingOff);
  const ParticleOutput start = state_after(0, sphere);
  const ParticleOutput end = state_after(500, sphere);
  std::vector<Vec3d> from(start.size());
  for (std::size_t i = 0; i < start.size(); ++i) from[start.id[i]] = start.position[i];
  const Vec3d v{200.0, -100.0, 50.0};
  const double scale = is_mixed() ? 1.0 : 1e-8;
  for (std::size_t i = 0; i < end.size(); ++i) {
    const Vec3d astray = end.position[i] - from[end.id[i]] - 200.0 * v;
    const Vec3d change = end.velocity[i] - v;
    ASSERT_LT(std::sqrt(dot(astray, astray)), 0.1 * scale);
    ASSERT_LT(std::sqrt(dot(change, change)), 1e-3 * scale);
    ASSERT_NEAR(end.density[i], 2700.0, 5e-3 * scale);
  }
}

// Without shear, viscosity and heat a collision of fluids is reversible but for the transfer: nothing is dissipated,
// nothing broken, and no output pretends otherwise.
TEST_P(EffectsOff, LeaveNoTraceInAFluid) {
  ParticleOutput p;
  LostWork lost;
  simulate(scene(collision(12.5e3), kEverythingOff), [&](const TimeLoop& loop) {
    lost = loop.lost_work();
    if (loop.step() < 100) return true;
    p = loop.engine().observe();
    EXPECT_EQ(loop.solver(), nullptr);
    EXPECT_EQ(loop.engine().elastic_energy(), 0.0);
    return false;
  });
  EXPECT_EQ(lost.plastic, 0.0);
  EXPECT_EQ(lost.viscous, 0.0);
  EXPECT_TRUE(p.internal_energy.empty());
  EXPECT_TRUE(p.shear_stress.empty());
  double pressure = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    EXPECT_EQ(p.damage[i], 0.0);
    pressure = std::max(pressure, p.pressure[i]);
    // Cold equation of state: P is a function of the density alone.
    const double mu = p.density[i] / 2700.0 - 1.0;
    EXPECT_NEAR(p.pressure[i], 2.67e10 * mu * (1.0 + mu), is_mixed() ? 1e4 : 1.0);
  }
  EXPECT_GT(pressure, 1e8);
}

struct Kept {
  std::string off;
  grid::GroupSet groups;
};

std::uint64_t particle_bytes(const Scene& scene) {
  std::uint64_t bytes = 0;
  simulate(scene, [&](const TimeLoop& loop) {
    bytes = loop.engine().stats().particle_bytes;
    return false;
  });
  return bytes;
}

// The same particles lie in the same slots whatever they hold, so that bytes are slots times the fields of the groups
// that are needed. Damage, whose flaws are as many as chance wants, is off everywhere.
TEST_P(EffectsOff, HaveNoMemory) {
  const std::vector<Kept> cases{
      {"effects.damage=false", {.elastic = true, .energy = true, .damage_level = true, .gravity = true}},
      {"effects.gravity=off", {.elastic = true, .energy = true, .damage_level = true, .gravity = false}},
      {"effects.energy=false", {.elastic = true, .energy = false, .damage_level = true, .gravity = true}},
      {"effects.strength=false", {.elastic = true, .energy = true, .damage_level = false, .gravity = true}},
      {"effects.shear=false", {.elastic = false, .energy = true, .damage_level = false, .gravity = true}},
  };
  std::uint64_t slots = 0;
  for (const Kept& kept : cases) {
    const Scene without = scene(collision(12.5e3), {"effects.damage=false", kept.off});
    const std::uint64_t per_slot = is_mixed() ? grid::ParticleStore<MixedPrecision>::bytes_per_particle(kept.groups)
                                              : grid::ParticleStore<DoublePrecision>::bytes_per_particle(kept.groups);
    const std::uint64_t bytes = particle_bytes(without);
    if (slots == 0) slots = bytes / per_slot;
    EXPECT_EQ(bytes, slots * per_slot) << kept.off;
    EXPECT_GE(slots, without.bodies[0].particles + without.bodies[1].particles);
  }
}

// Once everything is broken, damage and its flaws are given back.
TEST_P(EffectsOff, DamageGoesWhenAllIsBroken) {
  const Scene rock = scene(collision(12.5e3), {});
  const std::uint64_t lanes = is_mixed() ? MixedPrecision::kLanes : DoublePrecision::kLanes;
  std::uint64_t first = 0, last = 0;
  simulate(rock, [&](const TimeLoop& loop) {
    // Of each pack: debris fills its packs less well than rock did.
    const grid::EngineStats stats = loop.engine().stats();
    last = stats.particle_bytes / (stats.packs + (stats.lone_particles + lanes - 1) / lanes);
    if (loop.step() == 0) first = last;
    return loop.step() < 200;
  });
  EXPECT_GT(first, 5 * last / 4);
  for (const double damage : state_after(200, rock).damage) ASSERT_EQ(damage, 1.0);
}

INSTANTIATE_TEST_SUITE_P(Precisions, EffectsOff, testing::Values("mixed", "double"));

}  // namespace
}  // namespace breccia::sim::test

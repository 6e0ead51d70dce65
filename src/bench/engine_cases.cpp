#include "bench/engine_cases.hpp"

#include <algorithm>
#include <cmath>

#include "breccia/constants.hpp"
#include "breccia/random.hpp"
#include "scene/bodies.hpp"
#include "scene/orbit.hpp"

namespace breccia::bench {
namespace {

constexpr EngineCase kCases[] = {
    {"paper", 47324, 1.412, 0.0},           {"debris", 47324, 1.412, 0.25},    {"cell8_1e5", 50000, 8.0, 0.0},
    {"cell8_1e4", 5000, 8.0, 0.0},          {"cell8_1e6", 500000, 8.0, 0.0},   {"cell8_1e7", 5000000, 8.0, 0.0},
    {"broken_1e6", 500000, 8.0, 0.0, true}, {"paper_1e6", 500000, 1.412, 0.0}, {"paper_3e6", 1500000, 1.412, 0.0},
    {"debris_1e6", 500000, 1.412, 0.25},
};

constexpr EffectChoice kEffects[] = {
    {"all", [](EffectSwitches&) {}},
    {"no damage", [](EffectSwitches& e) { e.damage = Switch::kOff; }},
    {"no viscosity", [](EffectSwitches& e) { e.viscosity = Switch::kOff; }},
    {"no strength", [](EffectSwitches& e) { e.strength = e.damage = Switch::kOff; }},
    {"no energy", [](EffectSwitches& e) { e.energy = Switch::kOff; }},
    {"no shear", [](EffectSwitches& e) { e.shear = e.strength = e.damage = Switch::kOff; }},
};

}  // namespace

std::span<const EngineCase> engine_cases() { return kCases; }
std::span<const EffectChoice> effect_choices() { return kEffects; }

Scene make_scene(const EngineCase& c, const EffectChoice& effects, Precision precision) {
  Scene scene;
  scene.name = "bench";
  scene.materials.resize(1);
  const double radius = 50e3;
  const double volume = 4.0 / 3.0 * kPi * radius * radius * radius;
  scene.cell = std::cbrt(c.particles_per_cell * volume / static_cast<double>(c.particles_each));
  for (std::uint64_t b = 0; b < 2; ++b) {
    BodyParameters body;
    body.name = b == 0 ? "target" : "impactor";
    body.semi_axes = {radius, radius, radius};
    body.particles = c.particles_each;
    body.first_id = b * c.particles_each;
    body.mass = volume * scene.materials[0].eos.rho0;
    scene.bodies.push_back(body);
  }
  scene.impact = ImpactParameters{200.0, 15.0 * kPi / 180.0, 4.0 * radius};
  scene.effects.gravity = GravityMethod::kOff;
  effects.apply(scene.effects);
  scene.numerics.precision = precision;
  // The paper's step, scaled with the cell.
  scene.time.step = 1e5 / 819200.0 * scene.cell / 2500.0;
  scene::place_on_orbit(scene);
  return scene;
}

ParticleArrays make_state(const EngineCase& c, const Scene& scene, const mpi::Comm& comm) {
  ParticleArrays particles = scene::make_particles(scene, comm);
  if (c.broken) std::fill(particles.damage.begin(), particles.damage.end(), 1.0);
  if (c.debris_share == 0.0) return particles;
  const auto stride = static_cast<std::size_t>(std::lround(1.0 / c.debris_share));
  const RandomStream random(1, 0);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const std::uint64_t id = particles.id[i];
    if (id % stride != 0) continue;
    const auto [a, b] = random.uniform(id, 0);
    const auto [u, unused] = random.uniform(id, 1);
    static_cast<void>(unused);
    // Evenly in radius: most of the debris of an impact is slow and still near.
    const double r = kDebrisRadius * u;
    const double z = 2.0 * a - 1.0;
    const double phi = 2.0 * kPi * b;
    const double across = std::sqrt(1.0 - z * z);
    particles.position[i] = r * Vec3d{across * std::cos(phi), across * std::sin(phi), z};
  }
  return particles;
}

}  // namespace breccia::bench

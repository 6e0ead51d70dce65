#include "sim/setup.hpp"

#include <cmath>

#include "grid/particles.hpp"
#include "scene/bodies.hpp"

namespace breccia::sim {
namespace {

// Flaws of this rank's particles, body by body; particles are ordered by id and so by body.
material::FlawLists draw_all_flaws(const Scene& scene, const ParticleArrays& particles) {
  material::FlawLists all;
  all.first.push_back(0);
  std::size_t i = 0;
  for (std::uint32_t b = 0; b < scene.bodies.size(); ++b) {
    const BodyParameters& body = scene.bodies[b];
    const MaterialParameters& material = scene.materials[body.material];
    std::vector<std::uint64_t> wanted;
    for (; i < particles.size() && particles.body[i] == b; ++i) wanted.push_back(particles.id[i] - body.first_id);
    if (wanted.empty()) continue;
    const material::FlawLists flaws =
        material::draw_flaws(body.particles, body.mass / material.eos.rho0, material.damage, scene.seed, b, wanted);
    for (std::size_t n = 1; n < flaws.first.size(); ++n) {
      all.first.push_back(static_cast<std::uint32_t>(all.threshold.size()) + flaws.first[n]);
    }
    all.threshold.insert(all.threshold.end(), flaws.threshold.begin(), flaws.threshold.end());
  }
  return all;
}

}  // namespace

std::unique_ptr<grid::Engine> make_loaded_engine(const Scene& scene, const ResolvedEffects& effects, int threads,
                                                 const mpi::Comm& comm, grid::EngineMaker make) {
  return make_loaded_engine(scene, effects, scene::make_particles(scene, comm), threads, comm, make);
}

std::unique_ptr<grid::Engine> make_empty_engine(const Scene& scene, const ResolvedEffects& effects, int threads,
                                                const mpi::Comm& comm, grid::EngineMaker make) {
  grid::EngineSetup setup;
  setup.cell = scene.cell;
  setup.materials = scene.materials;
  setup.boundaries = scene.boundaries;
  setup.effects = effects.material;
  setup.self_gravity = effects.gravity;
  setup.uniform_gravity = scene.gravity.uniform;
  setup.numerics = scene.numerics;
  setup.threads = threads;
  return make(setup, comm);
}

std::unique_ptr<grid::Engine> make_loaded_engine(const Scene& scene, const ResolvedEffects& effects,
                                                 const ParticleArrays& particles, int threads, const mpi::Comm& comm,
                                                 grid::EngineMaker make) {
  auto engine = make_empty_engine(scene, effects, threads, comm, make);
  material::FlawLists flaws;
  if (effects.material.damage) {
    flaws = draw_all_flaws(scene, particles);
  } else {
    flaws.first.assign(particles.size() + 1, 0U);
  }
  std::vector<Vec3d> spins;
  for (const BodyParameters& body : scene.bodies) spins.push_back(body.spin);
  engine->insert(particles, flaws, spins);
  return engine;
}

double bytes_per_particle(const Scene& scene, const ResolvedEffects& effects) {
  const material::RuntimeEffects& fx = effects.material;
  const grid::GroupSet groups{.elastic = fx.shear,
                              .energy = fx.energy,
                              .damage_level = (fx.strength || fx.damage) && !fx.fully_damaged,
                              .flaws = fx.damage,
                              .gravity = effects.gravity};
  const bool mixed = scene.numerics.precision == Precision::kMixed;
  double bytes = static_cast<double>(mixed ? grid::ParticleStore<MixedPrecision>::bytes_per_particle(groups)
                                           : grid::ParticleStore<DoublePrecision>::bytes_per_particle(groups));
  if (fx.damage) {
    double particles = 0.0;
    double flaws = 0.0;
    for (const BodyParameters& b : scene.bodies) {
      const auto n = static_cast<double>(b.particles);
      particles += n;
      flaws += n * (std::log(n) + 0.5772);  // expected draws until every particle has one
    }
    bytes += flaws / particles * sizeof(float);
  }
  // Sorting holds one group twice; the largest is the velocity gradient.
  return bytes + (mixed ? 36.0 : 72.0);
}

double mean_spacing(const Scene& scene) {
  double volume = 0.0;
  double particles = 0.0;
  for (const BodyParameters& b : scene.bodies) {
    volume += b.mass / scene.materials[b.material].eos.rho0;
    particles += static_cast<double>(b.particles);
  }
  return particles > 0.0 ? std::cbrt(volume / particles) : 0.0;
}

}  // namespace breccia::sim

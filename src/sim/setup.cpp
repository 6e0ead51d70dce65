#include "sim/setup.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "breccia/error.hpp"
#include "grid/particles.hpp"
#include "mpi/together.hpp"
#include "scene/bodies.hpp"

namespace breccia::sim {
namespace {

// The 32-bit numbers of a field with one component.
std::vector<std::uint32_t> values_of(const EngineState& state, const std::string& name) {
  const auto column =
      std::ranges::find_if(state.columns, [&](const StateColumn& candidate) { return candidate.name == name; });
  std::vector<std::uint32_t> values(state.particles);
  if (column == state.columns.end() || column->values.size() != values.size() * sizeof(std::uint32_t)) {
    throw IoError("the checkpoint has no field " + name + " of the size this run needs");
  }
  if (!values.empty()) std::memcpy(values.data(), column->values.data(), column->values.size());
  return values;
}

// Who the particles of this rank are, in the order in which flaws are wanted.
struct Identities {
  std::vector<std::uint64_t> id;
  std::vector<std::uint32_t> body;
};

// The flaws of particles in any order, drawn body by body.
material::FlawLists draw_all_flaws(const Scene& scene, const Identities& particles) {
  const std::size_t count = particles.id.size();
  std::vector<std::vector<std::uint64_t>> wanted(scene.bodies.size());
  std::vector<std::size_t> row(count);  // in the lists of its body
  for (std::size_t i = 0; i < count; ++i) {
    auto& of_body = wanted.at(particles.body[i]);
    row[i] = of_body.size();
    of_body.push_back(particles.id[i] - scene.bodies[particles.body[i]].first_id);
  }
  std::vector<material::FlawLists> drawn;
  for (std::uint32_t b = 0; b < scene.bodies.size(); ++b) {
    const BodyParameters& body = scene.bodies[b];
    const MaterialParameters& material = scene.materials[body.material];
    drawn.push_back(
        material::draw_flaws(body.particles, body.mass / material.eos.rho0, material.damage, scene.seed, b, wanted[b]));
  }
  material::FlawLists all;
  all.first.push_back(0);
  for (std::size_t i = 0; i < count; ++i) {
    const std::span<const float> mine = drawn[particles.body[i]].of(row[i]);
    all.threshold.insert(all.threshold.end(), mine.begin(), mine.end());
    all.first.push_back(static_cast<std::uint32_t>(material::flaw_place(all.threshold.size())));
  }
  return all;
}

material::FlawLists no_flaws(std::size_t particles) {
  material::FlawLists none;
  none.first.assign(particles + 1, 0U);
  return none;
}

Identities identities_in(const EngineState& state, const Scene& scene) {
  const std::vector<std::uint32_t> low = values_of(state, "id_low");
  const std::vector<std::uint32_t> high = values_of(state, "id_high");
  const std::vector<std::uint32_t> body_material = values_of(state, "body_material");
  Identities particles;
  for (std::size_t i = 0; i < state.particles; ++i) {
    particles.id.push_back(low[i] | std::uint64_t{high[i]} << 32);
    particles.body.push_back(body_material[i] & 0xffffU);
    const std::uint32_t b = particles.body.back();
    if (b >= scene.bodies.size() || particles.id.back() - scene.bodies[b].first_id >= scene.bodies[b].particles ||
        body_material[i] >> 16 != scene.bodies[b].material) {
      throw IoError("the checkpoint has a particle that is not of this scene");
    }
  }
  return particles;
}

}  // namespace

std::unique_ptr<grid::Engine> make_loaded_engine(const Scene& scene, const ResolvedEffects& effects, int threads,
                                                 const mpi::Comm& comm, grid::EngineMaker make) {
  return make_loaded_engine(scene, effects, scene::make_particles(scene, comm), threads, comm, make);
}

grid::EngineSetup engine_setup(const Scene& scene, const ResolvedEffects& effects, int threads) {
  grid::EngineSetup setup;
  setup.cell = scene.cell;
  setup.materials = scene.materials;
  setup.boundaries = scene.boundaries;
  setup.effects = effects.material;
  setup.self_gravity = effects.gravity;
  setup.uniform_gravity = scene.gravity.uniform;
  setup.numerics = scene.numerics;
  setup.threads = threads;
  setup.slab_axis = scene.parallel.axis;
  setup.device_messages = scene.parallel.device_messages;
  return setup;
}

std::unique_ptr<grid::Engine> make_restored_engine(const Scene& scene, const ResolvedEffects& effects,
                                                   const EngineState& state, int threads, const mpi::Comm& comm,
                                                   grid::EngineMaker make) {
  auto engine = make(engine_setup(scene, effects, threads), comm);
  Identities particles;
  mpi::together<IoError>(comm, [&] { particles = identities_in(state, scene); });
  const bool grows = effects.material.damage && !state.damage_finished;
  engine->restore(state, grows ? draw_all_flaws(scene, particles) : no_flaws(state.particles));
  return engine;
}

std::unique_ptr<grid::Engine> make_loaded_engine(const Scene& scene, const ResolvedEffects& effects,
                                                 const ParticleArrays& particles, int threads, const mpi::Comm& comm,
                                                 grid::EngineMaker make) {
  auto engine = make(engine_setup(scene, effects, threads), comm);
  const material::FlawLists flaws =
      effects.material.damage ? draw_all_flaws(scene, {particles.id, particles.body}) : no_flaws(particles.size());
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
    bytes += flaws / particles * sizeof(material::FlawCode);
  }
  return bytes;
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

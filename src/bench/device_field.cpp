#include "bench/device_field.hpp"

#include "breccia/error.hpp"
#include "grid/state_columns.hpp"
#include "sim/setup.hpp"

namespace breccia::bench {
namespace {

// Fields that gravity does not need are left out: so many more particles fit.
Scene bare_scene(const GravityState& state, Precision precision) {
  Scene scene;
  scene.name = "bench";
  scene.materials.resize(1);
  scene.cell = state.softening / 0.05;
  BodyParameters body;
  body.name = "all";
  body.particles = state.position.size();
  scene.bodies.push_back(body);
  scene.numerics.precision = precision;
  EffectSwitches& e = scene.effects;
  e.gravity = GravityMethod::kTree;
  e.strength = e.damage = e.viscosity = e.energy = e.shear = Switch::kOff;
  return scene;
}

ParticleArrays particles_of(const GravityState& state) {
  ParticleArrays particles;
  const std::size_t n = state.position.size();
  for (std::size_t i = 0; i < n; ++i) particles.id.push_back(i);
  particles.position = state.position;
  particles.mass = state.mass;
  particles.velocity.resize(n);
  particles.body.resize(n);
  particles.material.resize(n);
  particles.damage.resize(n);
  return particles;
}

}  // namespace

DeviceField::DeviceField(const GravityState& state, Precision precision, const mpi::Comm& comm)
    : precision_(precision) {
  if (comm.size() > 1) throw UsageError("gravity --device cuda measures one rank");
  const grid::EngineChoice choice = grid::choose_engine(grid::Device::kCuda, precision, comm);
  device_ = choice.reason;
  const Scene scene = bare_scene(state, precision);
  engine_ = sim::make_loaded_engine(scene, sim::resolve_effects(scene), particles_of(state), 1, comm, choice.make);
}

std::unique_ptr<gravity::ResidentSolver> DeviceField::make_solver(GravityMethod method,
                                                                  const gravity::Parameters& parameters) const {
  return dynamic_cast<gravity::ResidentParticles&>(*engine_).make_resident_solver(method, parameters);
}

std::vector<Vec3d> DeviceField::held() const {
  const EngineState state = engine_->save();
  const auto id = grid::column_values<std::int32_t>(state, "id_low", 1);
  const std::vector<Vec3d> as_stored = grid::held_accelerations(state, precision_);
  std::vector<Vec3d> a(as_stored.size());
  for (std::size_t i = 0; i < a.size(); ++i) a[static_cast<std::size_t>(id[i])] = as_stored[i];
  return a;
}

}  // namespace breccia::bench

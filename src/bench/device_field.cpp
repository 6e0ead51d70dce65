#include "bench/device_field.hpp"

#include <cstring>

#include "breccia/error.hpp"
#include "grid/state_columns.hpp"
#include "sim/setup.hpp"

namespace breccia::bench {
namespace {

// Fields that gravity does not need are left out: so many more particles fit.
Scene bare_scene(const GravityState& state) {
  Scene scene;
  scene.name = "bench";
  scene.materials.resize(1);
  scene.cell = state.softening / 0.05;
  BodyParameters body;
  body.name = "all";
  body.particles = state.position.size();
  scene.bodies.push_back(body);
  scene.numerics.precision = Precision::kMixed;
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

template <class T>
std::vector<T> column(const EngineState& state, const char* name, std::size_t components) {
  const StateColumn& c = grid::find_column(state, name, sizeof(T), components);
  std::vector<T> values(state.particles * components);
  if (!values.empty()) std::memcpy(values.data(), c.values.data(), c.values.size());
  return values;
}

}  // namespace

DeviceField::DeviceField(const GravityState& state, const mpi::Comm& comm) {
  if (comm.size() > 1) throw UsageError("gravity --device cuda measures one rank");
  const grid::EngineChoice choice = grid::choose_engine(grid::Device::kCuda, comm);
  device_ = choice.reason;
  const Scene scene = bare_scene(state);
  engine_ = sim::make_loaded_engine(scene, sim::resolve_effects(scene), particles_of(state), 1, comm, choice.make);
}

std::unique_ptr<gravity::ResidentSolver> DeviceField::make_solver(GravityMethod method,
                                                                  const gravity::Parameters& parameters) const {
  return dynamic_cast<gravity::ResidentParticles&>(*engine_).make_resident_solver(method, parameters);
}

std::vector<Vec3d> DeviceField::held() const {
  const EngineState state = engine_->save();
  const auto values = column<float>(state, "gravity", 3);
  const auto id = column<std::int32_t>(state, "id_low", 1);
  std::vector<Vec3d> a(state.particles);
  for (std::size_t i = 0; i < a.size(); ++i) {
    a[static_cast<std::size_t>(id[i])] = {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
  }
  return a;
}

}  // namespace breccia::bench

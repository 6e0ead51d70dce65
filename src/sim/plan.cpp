#include "sim/plan.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>

#include "breccia/constants.hpp"
#include "cuda/device_plan.hpp"
#include "gravity/mesh/boxes.hpp"
#include "gravity/mesh/geometry.hpp"
#include "gravity/method.hpp"
#include "grid/device.hpp"
#include "scene/bodies.hpp"
#include "sim/setup.hpp"
#include "sim/step_size.hpp"

namespace breccia::sim {
namespace {

constexpr std::uint64_t kCalibrationParticles = 200'000;

double seconds_of(auto&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The same scene with fewer particles, if it has many: seconds per particle hardly depend on their number.
Scene thinned(const Scene& scene, double& scale) {
  std::uint64_t total = 0;
  for (const BodyParameters& b : scene.bodies) total += b.particles;
  scale = std::max(1.0, static_cast<double>(total) / static_cast<double>(kCalibrationParticles));
  Scene small = scene;
  if (scale == 1.0) return small;
  std::uint64_t first = 0;
  for (BodyParameters& b : small.bodies) {
    if (b.shape == Shape::kParticles) {
      scale = 1.0;
      return scene;
    }
    b.particles = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(static_cast<double>(b.particles) / scale));
    b.first_id = first;
    first += b.particles;
  }
  small.cell *= std::cbrt(scale);
  return small;
}

std::uint64_t count_particles(const Scene& scene) {
  std::uint64_t total = 0;
  for (const BodyParameters& b : scene.bodies) total += b.particles;
  return total;
}

double mesh_cell(const Scene& scene) {
  return scene.gravity.mesh > 0.0 ? scene.gravity.mesh : gravity::kCellsPerSpacing * mean_spacing(scene);
}

gravity::Box box_of(const BodyParameters& b) { return {b.position - b.semi_axes, b.position + b.semi_axes}; }

// Those that the mesh cares for.
std::vector<BodyParameters> bodies_with_mesh(const Scene& scene) {
  double mass = 0.0;
  for (const BodyParameters& b : scene.bodies) mass += b.mass;
  std::vector<BodyParameters> bodies;
  std::ranges::copy_if(scene.bodies, std::back_inserter(bodies), [&](const BodyParameters& b) {
    return static_cast<std::int64_t>(b.particles) >= gravity::kLeastBoxParticles &&
           b.mass >= gravity::kLeastBoxMass * mass;
  });
  return bodies;
}

// The matter as it starts: each body dense and by itself, those that the mesh would not care for outside.
gravity::Matter matter_at_start(const Scene& scene) {
  double mass = 0.0;
  for (const BodyParameters& b : scene.bodies) mass += b.mass;
  gravity::Matter matter{.particles = count_particles(scene)};
  std::vector<gravity::PlacedBody> bodies;
  for (const BodyParameters& b : bodies_with_mesh(scene)) {
    matter.in_boxes += b.particles;
    matter.mesh_nodes += gravity::mesh_nodes(box_of(b), mesh_cell(scene));
    bodies.push_back({.particles = b.particles,
                      .mass = b.mass,
                      .volume = 4.0 / 3.0 * kPi * b.semi_axes.x * b.semi_axes.y * b.semi_axes.z,
                      .centre = b.position});
  }
  matter.bodies = gravity::weigh(bodies, mass);
  return matter;
}

// What the scene's method comes down to when it starts.
gravity::MethodChoice gravity_method(const Scene& scene, const ResolvedEffects& effects) {
  if (!effects.gravity) return {GravityMethod::kOff, ""};
  if (effects.gravity_method != GravityMethod::kAuto) return {effects.gravity_method, ""};
  return gravity::cheapest_method(matter_at_start(scene),
                                  {.error = scene.gravity.error, .opening = scene.gravity.opening});
}

// One evaluation, from a sample of evenly spread points: the direct sum grows with the square of their number N, tree
// and mesh with N log N.
double gravity_seconds(const Scene& scene, GravityMethod method, const mpi::Comm& self) {
  constexpr std::size_t kSample = 16'384;
  std::vector<Vec3d> x(kSample);
  const std::vector<double> m(kSample, 1.0);
  for (std::size_t i = 0; i < kSample; ++i) {
    const auto n = static_cast<double>(i);
    x[i] = {std::fmod(0.8191725134 * n, 1.0), std::fmod(0.6710436067 * n, 1.0), std::fmod(0.5497004779 * n, 1.0)};
  }
  std::vector<Vec3d> acceleration(kSample);
  const gravity::Parameters parameters{.softening = 1e-3,
                                       .precision = scene.numerics.precision,
                                       .mesh = {.split = scene.gravity.split},
                                       .error = scene.gravity.error,
                                       .opening = scene.gravity.opening};
  const auto solver = gravity::make_solver(method, parameters, self, 1);
  solver->evaluate({x, m}, acceleration, {});
  const double sample = seconds_of([&] { solver->evaluate({x, m}, acceleration, {}); });
  const double all = std::max(2.0, static_cast<double>(count_particles(scene)));
  const double ratio = all / static_cast<double>(kSample);
  return sample * ratio * (method == GravityMethod::kDirect ? ratio : std::log(all) / std::log(1.0 * kSample));
}

// Resident memory of runs of 60,000 particles beside particles and nodes [bytes]: of a particle what outputs copy and
// sortings list, and what gravity sorts and lists; of a tile what it is found by and reaches, with thin debris.
// Program, libraries and MPI.
constexpr double kOutputBytes = 400.0;
constexpr double kTreeBytes = 180.0;
constexpr double kMeshBytes = 280.0;
constexpr double kTileBytes = 5400.0;
constexpr double kProgramBytes = 3.3e7;

double host_bytes(const Scene& scene, const grid::EngineStats& sample, double scale, GravityMethod gravity, int ranks) {
  const double tiles = static_cast<double>(sample.tiles) * kTileBytes;
  const double engine = (static_cast<double>(sample.particle_bytes + sample.grid_bytes) + tiles) * scale;
  double of_particle = kOutputBytes;
  if (gravity == GravityMethod::kTree) of_particle += kTreeBytes;
  if (gravity == GravityMethod::kTreePm) of_particle += kMeshBytes;
  return kProgramBytes + (engine + of_particle * static_cast<double>(count_particles(scene))) / ranks;
}

double device_bytes(const Scene& scene, const ResolvedEffects& effects, const grid::Engine& sample, double scale,
                    int ranks) {
  cuda::DevicePlan plan{.setup = engine_setup(scene, effects, 1),
                        .sample = sample.save(),
                        .flaws = sample.flaws().threshold.size(),
                        .scale = scale,
                        .ranks = ranks,
                        .gravity = effects.gravity ? effects.gravity_method : GravityMethod::kOff,
                        .parameters = {.precision = scene.numerics.precision,
                                       .error = scene.gravity.error,
                                       .opening = scene.gravity.opening},
                        .matter = matter_at_start(scene)};
  for (const BodyParameters& b : bodies_with_mesh(scene)) {
    plan.boxes.push_back({b.particles, gravity::MeshGeometry(box_of(b), mesh_cell(scene)).size});
  }
  cuda::DeviceMemory memory;
  if (!grid::device_memory(plan, memory)) return 0.0;
  return static_cast<double>(memory.engine + memory.gravity);
}

}  // namespace

Plan make_plan(const Scene& scene) {
  const ResolvedEffects effects = resolve_effects(scene);
  Plan plan;
  plan.effects = effects.decisions;
  const gravity::MethodChoice choice = gravity_method(scene, effects);
  plan.gravity_method = gravity::name_of(choice.method);
  for (EffectDecision& effect : plan.effects) {
    if (effect.name == "gravity" && !choice.reason.empty()) effect.reason += "; at the start " + choice.reason;
  }
  const StepSize step = stable_step(scene, initial_speeds(scene, effects.material.shear), effects.material.viscosity);
  plan.time_step = step.seconds;
  plan.time_step_limited_by = step.limited_by;
  for (const BodyParameters& b : scene.bodies) plan.particles += b.particles;
  plan.bytes_per_particle = bytes_per_particle(scene, effects);
  return plan;
}

Calibration calibrate(const Scene& scene, int ranks) {
  constexpr int kSteps = 8;
  const mpi::Comm self(MPI_COMM_SELF);
  double scale = 1.0;
  const Scene small = thinned(scene, scale);
  const ResolvedEffects effects = resolve_effects(small);
  const auto engine = make_loaded_engine(small, effects, 1, self);
  const double step = stable_step(small, engine->signal_speeds(), effects.material.viscosity).seconds;
  engine->scatter(0.5 * step);
  const auto one_step = [&] {
    engine->update_grid(step);
    engine->gather_scatter(step);
  };
  one_step();
  const GravityMethod gravity = gravity_method(scene, effects).method;
  Calibration found;
  found.seconds_per_step = seconds_of([&] {
                             for (int i = 0; i < kSteps; ++i) one_step();
                           }) /
                           kSteps * scale;
  if (effects.gravity) found.seconds_per_step += gravity_seconds(scene, gravity, self) / scene.gravity.interval;
  found.host_bytes = host_bytes(scene, engine->stats(), scale, gravity, ranks);
  found.device_bytes = device_bytes(scene, effects, *engine, scale, ranks);
  return found;
}

}  // namespace breccia::sim

#include "sim/plan.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "breccia/constants.hpp"
#include "gravity/mesh/boxes.hpp"
#include "gravity/method.hpp"
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

// The matter as it starts: each body dense and by itself, those that the mesh would not care for outside.
gravity::Matter matter_at_start(const Scene& scene) {
  double mass = 0.0;
  for (const BodyParameters& b : scene.bodies) mass += b.mass;
  const double spacing = mean_spacing(scene);
  const double cell = scene.gravity.mesh > 0.0 ? scene.gravity.mesh : gravity::kCellsPerSpacing * spacing;
  gravity::Matter matter{.particles = count_particles(scene)};
  std::vector<gravity::PlacedBody> bodies;
  for (const BodyParameters& b : scene.bodies) {
    if (static_cast<std::int64_t>(b.particles) < gravity::kLeastBoxParticles || b.mass < gravity::kLeastBoxMass * mass)
      continue;
    matter.in_boxes += b.particles;
    matter.mesh_nodes += gravity::mesh_nodes({b.position - b.semi_axes, b.position + b.semi_axes}, cell);
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

double calibrate(const Scene& scene) {
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
  double seconds = seconds_of([&] {
                     for (int i = 0; i < kSteps; ++i) one_step();
                   }) /
                   kSteps * scale;
  if (effects.gravity)
    seconds += gravity_seconds(scene, gravity_method(scene, effects).method, self) / scene.gravity.interval;
  return seconds;
}

}  // namespace breccia::sim

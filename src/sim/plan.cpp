#include "sim/plan.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "gravity/solver.hpp"
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

// What the scene's method comes down to for its number of particles.
GravityMethod gravity_method(const Scene& scene, const ResolvedEffects& effects) {
  if (!effects.gravity) return GravityMethod::kOff;
  return effects.gravity_method == GravityMethod::kAuto
             ? gravity::cheapest_method(count_particles(scene), scene.gravity.error)
             : effects.gravity_method;
}

const char* name_of(GravityMethod method) {
  switch (method) {
    case GravityMethod::kOff:
      return "off";
    case GravityMethod::kTree:
      return "tree";
    case GravityMethod::kTreePm:
      return "treepm";
    default:
      return "direct";
  }
}

// One evaluation, from a sample of evenly spread points: the direct sum grows with the square of their number.
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
                                       .error = scene.gravity.error,
                                       .opening = scene.gravity.opening};
  const auto solver = gravity::make_solver(method, parameters, self, 1);
  solver->evaluate({x, m}, acceleration, {});
  const double sample = seconds_of([&] { solver->evaluate({x, m}, acceleration, {}); });
  const double ratio = static_cast<double>(count_particles(scene)) / static_cast<double>(kSample);
  return sample * (method == GravityMethod::kDirect ? ratio * ratio : ratio);
}

}  // namespace

Plan make_plan(const Scene& scene) {
  const ResolvedEffects effects = resolve_effects(scene);
  Plan plan;
  plan.effects = effects.decisions;
  const GravityMethod method = gravity_method(scene, effects);
  plan.gravity_method = name_of(method);
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
  if (effects.gravity) seconds += gravity_seconds(scene, gravity_method(scene, effects), self) / scene.gravity.interval;
  return seconds;
}

}  // namespace breccia::sim

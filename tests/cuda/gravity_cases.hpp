// Fields of gravity on the emulated device and the host's for the same particles.
#pragma once

#include <cstdlib>

#include "gravity/resident.hpp"
#include "grid/state_columns.hpp"
#include "tests/cuda/engine_cases.hpp"

namespace breccia::cuda {

using gravity::Parameters;

// The accelerations that the particles of this rank hold.
inline std::vector<Vec3d> held(const Engine& engine, Precision precision) {
  return grid::held_accelerations(engine.save(), precision);
}
inline std::vector<std::int32_t> ids(const Engine& engine) {
  return grid::column_values<std::int32_t>(engine.save(), "id_low", 1);
}

inline std::unique_ptr<Engine> loaded(const Scene& scene, const mpi::Comm& comm) {
  EngineSetup setup = setup_for(scene);
  setup.self_gravity = true;
  auto engine = make_cuda_engine(setup, comm);
  fill(*engine, scene, comm);
  return engine;
}

// What an evaluation took of the devices of all ranks is known before it begins, and not much less than that is asked.
inline void expect_memory_is_known(Engine& engine, GravityMethod method, const Parameters& parameters,
                                   std::size_t taken, const mpi::Comm& comm) {
  const double sum = comm.sum(static_cast<double>(taken));  // the ranks share the device
  const auto fits_in = [&](double bytes) {
    const auto device = cuda_emulation::used_bytes() + static_cast<std::size_t>(bytes);
    setenv("BRECCIA_EMULATED_MEMORY", std::to_string(device).c_str(), 1);
    bool fits = true;
    try {
      dynamic_cast<gravity::ResidentParticles&>(engine).make_resident_solver(method, parameters);
    } catch (const UsageError& error) {
      fits = false;
      EXPECT_NE(std::string(error.what()).find("not enough memory for gravity"), std::string::npos) << error.what();
    }
    unsetenv("BRECCIA_EMULATED_MEMORY");
    return fits;
  };
  EXPECT_FALSE(fits_in(sum - 1.0));
  EXPECT_TRUE(fits_in(2.0 * sum)) << sum;
}

// A field on the devices of all ranks, and the same from the host's solver on one rank for the same predicted
// positions.
struct Fields {
  gravity::Stats device_stats, host_stats;
  double rms = 0.0;      // of |difference| / |a|
  double largest = 0.0;  // |difference| over the largest |a|
};
inline Fields evaluate(const Scene& scene, GravityMethod method, const Parameters& parameters, const mpi::Comm& comm) {
  constexpr double ahead = 20.0;
  const auto engine = loaded(scene, comm);
  const std::size_t before = cuda_emulation::used_bytes();
  cuda_emulation::forget_most_bytes();
  auto resident = dynamic_cast<gravity::ResidentParticles&>(*engine).make_resident_solver(method, parameters);
  if (!resident) throw UsageError("the device has not this method");
  resident->evaluate_and_hold(ahead);
  const gravity::Stats device_stats = resident->last();
  const std::size_t taken = cuda_emulation::most_bytes() - before;
  resident.reset();
  expect_memory_is_known(*engine, method, parameters, taken, comm);

  const auto all = loaded(scene, self());
  std::vector<Vec3d> position;
  std::vector<double> mass;
  all->predict(ahead, position, mass);
  std::vector<Vec3d> expected(position.size());
  const auto solver = gravity::make_solver(method, parameters, self(), 1);
  solver->evaluate({position, mass}, expected, {});
  std::vector<Vec3d> by_id(position.size());
  const std::vector<std::int32_t> id = ids(*all);
  for (std::size_t i = 0; i < id.size(); ++i) by_id[static_cast<std::size_t>(id[i])] = expected[i];

  Fields fields{device_stats, solver->last()};
  const std::vector<Vec3d> found = held(*engine, scene.numerics.precision);
  const std::vector<std::int32_t> found_id = ids(*engine);
  double squares = 0.0, largest_field = 0.0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Vec3d a = by_id[static_cast<std::size_t>(found_id[i])];
    const Vec3d d = found[i] - a;
    squares += dot(d, d) / dot(a, a);
    fields.largest = std::max(fields.largest, std::sqrt(dot(d, d)));
    largest_field = std::max(largest_field, std::sqrt(dot(a, a)));
  }
  EXPECT_EQ(comm.sum(static_cast<std::uint64_t>(found.size())), position.size());
  fields.rms = std::sqrt(comm.sum(squares) / static_cast<double>(position.size()));
  fields.largest = comm.max(fields.largest) / comm.max(largest_field);
  EXPECT_TRUE(std::isfinite(fields.rms)) << "a largest value does not show what is no number";
  return fields;
}

// Sums of 500 terms in another order: their roundings, 1e-16 and 6e-8, as a random walk, twice over.
inline double rounding(Precision precision) { return precision == Precision::kDouble ? 1e-14 : 3e-6; }

inline void number(Scene& scene) {
  std::uint64_t id = 0;
  for (BodyParameters& body : scene.bodies) {
    body.first_id = id;
    id += body.particles;
  }
}

// Two bodies: cells of all sizes, and targets of all kinds.
inline Scene bodies(Precision precision) {
  Scene scene = small_impact(precision);
  for (BodyParameters& body : scene.bodies) body.particles = 1200;
  number(scene);
  return scene;
}

// The same with ejecta far around them.
inline Scene crowd(Precision precision) {
  Scene scene = bodies(precision);
  scene.bodies.push_back(scene.bodies[0]);
  BodyParameters& ejecta = scene.bodies.back();
  ejecta.lattice = Lattice::kRandom;
  ejecta.particles = 700;
  ejecta.semi_axes = {900e3, 300e3, 300e3};
  ejecta.mass *= 0.1;
  number(scene);
  return scene;
}

// Bodies too far from each other for one mesh over both.
inline Scene two_crowds(Precision precision) {
  Scene scene = crowd(precision);
  scene.bodies[1].position.x = -500e3;
  return scene;
}

}  // namespace breccia::cuda

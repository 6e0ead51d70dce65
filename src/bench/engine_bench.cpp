#include "bench/engine_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/cpu_time.hpp"
#include "bench/json_output.hpp"
#include "breccia/constants.hpp"
#include "breccia/isa.hpp"
#include "breccia/precision.hpp"
#include "io/machine.hpp"
#include "scene/bodies.hpp"
#include "scene/orbit.hpp"
#include "sim/setup.hpp"

namespace breccia::bench {
namespace {

// Two spheres of radius 50 km on the orbit of the paper's flagship (physics.md 6).
Scene two_spheres(std::uint64_t particles_each, double particles_per_cell, Precision precision) {
  Scene scene;
  scene.name = "bench";
  scene.materials.resize(1);
  const double radius = 50e3;
  const double volume = 4.0 / 3.0 * kPi * radius * radius * radius;
  scene.cell = std::cbrt(particles_per_cell * volume / static_cast<double>(particles_each));
  for (int b = 0; b < 2; ++b) {
    BodyParameters body;
    body.name = b == 0 ? "target" : "impactor";
    body.semi_axes = {radius, radius, radius};
    body.particles = particles_each;
    body.first_id = static_cast<std::uint64_t>(b) * particles_each;
    body.mass = volume * scene.materials[0].eos.rho0;
    scene.bodies.push_back(body);
  }
  scene.impact = ImpactParameters{200.0, 15.0 * kPi / 180.0, 4.0 * radius};
  scene.effects.gravity = GravityMethod::kOff;
  scene.numerics.precision = precision;
  // The paper's step, scaled with the cell.
  scene.time.step = 1e5 / 819200.0 * scene.cell / 2500.0;
  scene::place_on_orbit(scene);
  return scene;
}

struct Case {
  const char* name;
  std::uint64_t particles_each;
  double particles_per_cell;
};
constexpr Case kCases[] = {{"paper", 47324, 1.412}, {"cell8_1e6", 500000, 8.0}};

// One sort cycle: 31 fused steps and one in two halves around a sorting.
void one_cycle(grid::Engine& engine, double dt, int interval) {
  for (int n = 1; n < interval; ++n) {
    engine.update_grid(dt);
    engine.gather_scatter(dt);
  }
  engine.update_grid(dt);
  engine.gather(dt);
  engine.sort();
  engine.scatter(0.5 * dt);
}

struct Measured {
  double rate = 0.0;  ///< particle-steps per second of user CPU time of all threads together
  double wall_rate = 0.0;
  double bytes_per_particle = 0.0;
};

Measured measure(const Case& c, Precision precision, int threads, double seconds) {
  const Scene scene = two_spheres(c.particles_each, c.particles_per_cell, precision);
  const sim::ResolvedEffects effects = sim::resolve_effects(scene);
  const mpi::Comm self(MPI_COMM_SELF);
  const auto engine = sim::make_loaded_engine(scene, effects, threads, self);
  const double dt = *scene.time.step;
  const int interval = scene.numerics.sort_interval;
  engine->scatter(0.5 * dt);
  one_cycle(*engine, dt, interval);

  const double steps = static_cast<double>(2 * c.particles_each) * interval;
  Measured best;
  double spent = 0.0;
  for (int cycle = 0; cycle < 3 || spent < seconds; ++cycle) {
    const Timing start = now();
    one_cycle(*engine, dt, interval);
    const Timing end = now();
    const double elapsed = end.wall - start.wall;
    best.rate = std::max(best.rate, steps / (end.user - start.user));
    best.wall_rate = std::max(best.wall_rate, steps / elapsed);
    spent += elapsed;
  }
  const grid::EngineStats stats = engine->stats();
  best.bytes_per_particle =
      static_cast<double>(stats.particle_bytes + stats.grid_bytes) / static_cast<double>(stats.particles);
  return best;
}

}  // namespace

void run_engine_bench(const EngineBenchOptions& options) {
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  const io::Machine machine = io::this_machine();
  std::FILE* table = options.json == "-" ? stderr : stdout;
  fmt::print(table, "{}, {}, {}; no gravity, sorting included, best cycle of {} steps\n", machine.cpu_model,
             isa_name(active_isa()), io::library_versions().at(1).second, 32);
  fmt::print(table, "{:<10} {:<6} {:>5} {:>24} {:>24} {:>15}\n", "case", "prec.", "cores", "Mp-steps/s of CPU time",
             "Mp-steps/s of wall time", "bytes/particle");
  for (const Case& c : kCases) {
    if (options.quick && c.particles_each > 100000) continue;
    for (const Precision precision : {Precision::kMixed, Precision::kDouble}) {
      for (const int cores : {1, 2}) {
        const Measured m = measure(c, precision, cores, options.quick ? 2.0 : 8.0);
        const char* name = precision == Precision::kMixed ? MixedPrecision::kName : DoublePrecision::kName;
        fmt::print(table, "{:<10} {:<6} {:>5} {:>24.2f} {:>24.2f} {:>15.0f}\n", c.name, name, cores, 1e-6 * m.rate,
                   1e-6 * m.wall_rate, m.bytes_per_particle);
        std::fflush(table);
        results.push_back({{"case", c.name},
                           {"precision", name},
                           {"cores", cores},
                           {"effects", "all"},
                           {"particle_steps_per_second", cores == 1 ? m.rate : m.wall_rate},
                           {"particle_steps_per_cpu_second", m.rate},
                           {"particle_steps_per_wall_second", m.wall_rate},
                           {"bytes_per_particle", m.bytes_per_particle}});
      }
    }
  }
  write_json(results, options.json);
}

}  // namespace breccia::bench

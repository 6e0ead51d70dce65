#include "bench/engine_bench.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "bench/cpu_time.hpp"
#include "bench/engine_cases.hpp"
#include "bench/json_output.hpp"
#include "breccia/error.hpp"
#include "breccia/isa.hpp"
#include "breccia/precision.hpp"
#include "grid/device.hpp"
#include "io/machine.hpp"
#include "sim/setup.hpp"

namespace breccia::bench {
namespace {

// Wall time of a cycle [s]: passes over the particles, in which most of the grid update trails; what is left of it;
// sortings.
struct Sections {
  double passes = 0.0, grid = 0.0, sorting = 0.0;
};

// One sort cycle: fused steps and one in two halves around a sorting.
Sections one_cycle(grid::Engine& engine, double dt, int interval) {
  Sections spent;
  const auto timed = [](double& section, auto&& work) {
    const double begin = MPI_Wtime();
    work();
    section += MPI_Wtime() - begin;
  };
  for (int n = 1; n < interval; ++n) {
    timed(spent.grid, [&] { engine.update_grid(dt); });
    timed(spent.passes, [&] { engine.gather_scatter(dt); });
  }
  timed(spent.grid, [&] { engine.update_grid(dt); });
  timed(spent.passes, [&] { engine.gather(dt); });
  timed(spent.sorting, [&] { engine.sort(); });
  timed(spent.passes, [&] { engine.scatter(0.5 * dt); });
  return spent;
}

struct Measured {
  double rate = 0.0;  ///< particle-steps per second of user CPU time of all threads together
  double wall_rate = 0.0;
  Sections sections;  ///< of the cycle with the best wall time, on the first rank
  double bytes_per_particle = 0.0;
};

// What is measured together: a state, its effects, and whether bits may depend on the number of ranks.
struct Row {
  EngineCase state;
  EffectChoice effects;
  bool reproducible = false;

  [[nodiscard]] std::string name() const { return std::string(effects.name) + (reproducible ? ", reproducible" : ""); }
};

Measured measure(const Row& row, Precision precision, int threads, double seconds, const mpi::Comm& comm,
                 grid::EngineMaker make) {
  const EngineCase& c = row.state;
  Scene scene = make_scene(c, row.effects, precision);
  scene.numerics.reproducible = row.reproducible;
  const auto engine =
      sim::make_loaded_engine(scene, sim::resolve_effects(scene), make_state(c, scene, comm), threads, comm, make);
  engine->finish_damage();  // where all rock is broken from the start
  const double dt = *scene.time.step;
  const int interval = scene.numerics.sort_interval;
  engine->scatter(0.5 * dt);
  one_cycle(*engine, dt, interval);

  const double steps = static_cast<double>(2 * c.particles_each) * interval;
  Measured best;
  double spent = 0.0;
  for (int cycle = 0; cycle < 3 || spent < seconds; ++cycle) {
    comm.barrier();
    const double user = now().user;
    const double wall = MPI_Wtime();
    const Sections sections = one_cycle(*engine, dt, interval);
    const double of_all_ranks = comm.sum(now().user - user);
    const double elapsed = comm.max(MPI_Wtime() - wall);
    best.rate = std::max(best.rate, steps / of_all_ranks);
    if (steps / elapsed > best.wall_rate) {
      best.wall_rate = steps / elapsed;
      best.sections = sections;
    }
    spent += elapsed;
  }
  const grid::EngineStats stats = engine->stats();
  best.bytes_per_particle = static_cast<double>(comm.sum(stats.particle_bytes + stats.grid_bytes + stats.sort_bytes)) /
                            static_cast<double>(comm.sum(stats.particles));
  return best;
}

template <class Named>
std::vector<Named> chosen(std::span<const Named> all, const std::vector<std::string>& names) {
  std::vector<Named> found;
  std::vector<std::string_view> known;
  for (const Named& item : all) {
    known.push_back(item.name);
    if (std::find(names.begin(), names.end(), item.name) != names.end()) found.push_back(item);
  }
  if (found.size() != names.size()) {
    throw UsageError(fmt::format("{}: unknown; there are {}", fmt::join(names, ", "), fmt::join(known, ", ")));
  }
  return found;
}

std::vector<Precision> chosen_precisions(const std::string& name) {
  if (name == MixedPrecision::kName) return {Precision::kMixed};
  if (name == DoublePrecision::kName) return {Precision::kDouble};
  return {Precision::kMixed, Precision::kDouble};
}

const char* name_of(Precision precision) {
  return precision == Precision::kMixed ? MixedPrecision::kName : DoublePrecision::kName;
}

std::string in_percent(const Sections& s) {
  const double whole = s.passes + s.grid + s.sorting;
  return fmt::format("{:.1f} {:.1f} {:.1f} %", 100.0 * s.passes / whole, 100.0 * s.grid / whole,
                     100.0 * s.sorting / whole);
}

// The lines of the table: every state with all effects, and the paper's with one effect less at a time and with the
// same bits on any number of ranks.
std::vector<Row> rows(const EngineBenchOptions& options) {
  const bool standard = options.cases.empty() && options.effects.empty();
  std::vector<std::string> cases = options.cases;
  if (cases.empty()) cases = {"paper"};
  if (standard && !options.quick) cases = {"paper", "debris", "cell8_1e5", "cell8_1e6"};
  std::vector<std::string> effects = options.effects;
  if (effects.empty()) effects = {"all"};
  std::vector<Row> all;
  for (const EngineCase& c : chosen(engine_cases(), cases)) {
    for (const EffectChoice& e : chosen(effect_choices(), effects)) all.push_back({c, e});
  }
  if (options.reproducible) {
    for (std::size_t n = all.size(); n-- > 0;) {
      all.insert(all.begin() + static_cast<std::ptrdiff_t>(n) + 1, {all[n].state, all[n].effects, true});
    }
  }
  if (standard && !options.quick) {
    for (const EffectChoice& e : effect_choices().subspan(1)) all.push_back({engine_cases().front(), e});
    all.push_back({engine_cases().front(), effect_choices().front(), true});
  }
  return all;
}

}  // namespace

void run_engine_bench(const EngineBenchOptions& options) {
  const std::vector<Row> table_rows = rows(options);
  const mpi::Comm comm;
  const grid::EngineChoice engine =
      grid::choose_engine(options.device == "cuda" ? grid::Device::kCuda : grid::Device::kHost,
                          chosen_precisions(options.precision).front(), comm);
  std::vector<int> cores = options.cores.empty() ? std::vector<int>{1, 2} : options.cores;
  if (engine.device != "host") cores = {1};
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  const io::Machine machine = io::this_machine();
  std::map<std::string, double> plain_rates;
  std::FILE* table = options.json == "-" ? stderr : stdout;
  if (comm.is_root()) {
    if (engine.device != "host") fmt::print(table, "device: {}; ", engine.reason);
    fmt::print(table, "{}, {}, {}; {} ranks; no gravity, sorting included, best cycle of {} steps\n", machine.cpu_model,
               isa_name(active_isa()), io::library_versions().at(1).second, comm.size(),
               NumericsParameters{}.sort_interval);
    fmt::print(table, "{:<10} {:<20} {:<6} {:>5} {:>24} {:>24} {:>20} {:>15}\n", "case", "effects", "prec.", "cores",
               "Mp-steps/s of CPU time", "Mp-steps/s of wall time", "passes grid sorting", "bytes/particle");
  }
  for (const Row& row : table_rows) {
    for (const Precision precision : chosen_precisions(options.precision)) {
      for (const int threads : cores) {
        const Measured m = measure(row, precision, threads, options.seconds, comm, engine.make);
        if (!comm.is_root()) continue;
        // Of the same state, precision and cores without it: measured before.
        double& plain =
            plain_rates[fmt::format("{} {} {} {}", row.state.name, row.effects.name, name_of(precision), threads)];
        const double price = row.reproducible && plain > 0.0 ? 100.0 * (plain / m.wall_rate - 1.0) : 0.0;
        if (!row.reproducible) plain = m.wall_rate;
        fmt::print(table, "{:<10} {:<20} {:<6} {:>5} {:>24.2f} {:>24.2f} {:>20} {:>15.0f}{}\n", row.state.name,
                   row.name(), name_of(precision), threads * comm.size(), 1e-6 * m.rate, 1e-6 * m.wall_rate,
                   in_percent(m.sections), m.bytes_per_particle,
                   row.reproducible ? fmt::format("  price {:.1f} % of wall time", price) : "");
        std::fflush(table);
        results.push_back(
            {{"case", row.state.name},
             {"precision", name_of(precision)},
             {"cores", threads * comm.size()},
             {"ranks", comm.size()},
             {"effects", row.name()},
             {"particle_steps_per_second",
              threads * comm.size() == 1 && engine.device == "host" ? m.rate : m.wall_rate},
             {"particle_steps_per_cpu_second", m.rate},
             {"particle_steps_per_wall_second", m.wall_rate},
             {"seconds_of_a_cycle",
              {{"passes", m.sections.passes}, {"grid", m.sections.grid}, {"sorting", m.sections.sorting}}},
             {"bytes_per_particle", m.bytes_per_particle}});
      }
    }
  }
  if (!comm.is_root()) return;
  const nlohmann::ordered_json document = {{"machine", machine.cpu_model},
                                           {"instruction_set", isa_name(active_isa())},
                                           {"compiler", io::library_versions().at(1).second},
                                           {"device", engine.device},
                                           {"device_name", engine.reason},
                                           {"results", results}};
  write_json(document, options.json);
}

}  // namespace breccia::bench

#include "bench/work_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "bench/engine_cases.hpp"
#include "bench/json_output.hpp"
#include "gravity/solver.hpp"
#include "sim/balance.hpp"
#include "sim/setup.hpp"

namespace breccia::bench {
namespace {

// A state that one of the weights decides.
struct WorkState {
  const char* name;
  EngineCase matter;
  double damage;  // of all particles
  double spread;  // positions times this: 1 as they are, large for particles that are alone
  bool lone_without_grid;
};

constexpr WorkState kStates[] = {
    {"full tiles, intact", {"", 50000, 8.0, 0.0}, 0.0, 1.0, true},
    {"full tiles, broken", {"", 50000, 8.0, 0.0}, 1.0, 1.0, true},
    {"paper, intact", {"", 47324, 1.412, 0.0}, 0.0, 1.0, true},
    {"paper, broken", {"", 47324, 1.412, 0.0}, 1.0, 1.0, true},
    {"thin tiles", {"", 20000, 1.412, 0.0}, 1.0, 3.0, false},
    {"one in a tile", {"", 10000, 1.412, 0.0}, 1.0, 12.0, false},
    {"lone particles", {"", 47324, 1.412, 0.0}, 1.0, 12.0, true},
};

constexpr GravityMethod kMethods[] = {GravityMethod::kDirect, GravityMethod::kTree, GravityMethod::kTreePm};
constexpr const char* kMethodNames[] = {"direct sum", "tree", "treepm"};

template <class F>
double least_time(double seconds, F&& work) {
  double best = HUGE_VAL;
  double spent = 0.0;
  while (spent < seconds) {
    // Wall time, the best of many: the clock of CPU time is too coarse for single steps.
    const double start = MPI_Wtime();
    work();
    const double time = MPI_Wtime() - start;
    best = std::min(best, time);
    spent += time;
  }
  return best;
}

std::unique_ptr<grid::Engine> make_engine(const WorkState& state, Precision precision, double& dt) {
  Scene scene = make_scene(state.matter, effect_choices().front(), precision);
  scene.numerics.lone_without_grid = state.lone_without_grid;
  scene.effects.damage = Switch::kOn;
  for (BodyParameters& body : scene.bodies) body.damage = state.damage;
  const mpi::Comm self(MPI_COMM_SELF);
  ParticleArrays particles = make_state(state.matter, scene, self);
  for (Vec3d& x : particles.position) x = state.spread * x;
  dt = *scene.time.step;
  return sim::make_loaded_engine(scene, sim::resolve_effects(scene), particles, 1, self);
}

class Table {
 public:
  explicit Table(const std::string& json) : json_(json), out_(json == "-" ? stderr : stdout) {
    fmt::print(out_, "{:<20} {:<7} {:>9} {:>8} {:>8} {:>13} {:>12} {:>6}\n", "state", "prec.", "particles", "tiles",
               "packs", "measured [ms]", "counted [ms]", "ratio");
  }
  void add(const char* name, const char* precision, const grid::EngineStats& stats, double seconds, double counted) {
    fmt::print(out_, "{:<20} {:<7} {:>9} {:>8} {:>8} {:>13.4f} {:>12.4f} {:>6.2f}\n", name, precision, stats.particles,
               stats.tiles, stats.packs, 1e3 * seconds, 1e3 * counted, seconds / counted);
    std::fflush(out_);
    rows_.push_back({{"state", name},
                     {"precision", precision},
                     {"particles", stats.particles},
                     {"tiles", stats.tiles},
                     {"packs", stats.packs},
                     {"measured", seconds},
                     {"counted", counted}});
  }
  void write() const {
    if (!json_.empty()) write_json(rows_, json_);
  }

 private:
  std::string json_;
  std::FILE* out_;
  nlohmann::ordered_json rows_ = nlohmann::ordered_json::array();
};

void measure_steps(const WorkState& state, Precision precision, double seconds, Table& table) {
  double dt = 0.0;
  const auto engine = make_engine(state, precision, dt);
  const double counted = 1e-12 * static_cast<double>(mpi::total(engine->work({})));
  engine->scatter(0.5 * dt);
  const double step = least_time(seconds, [&] {
    engine->update_grid(dt);
    engine->gather_scatter(dt);
  });
  table.add(state.name, precision == Precision::kMixed ? "mixed" : "double", engine->stats(), step, counted);
}

void measure_gravity(std::size_t method, double seconds, Table& table) {
  double dt = 0.0;
  const WorkState& state = kStates[2];
  const auto engine = make_engine(state, Precision::kMixed, dt);
  std::vector<Vec3d> position;
  std::vector<double> mass;
  engine->predict(0.0, position, mass);
  std::vector<Vec3d> acceleration(position.size());
  const auto solver = gravity::make_solver(kMethods[method], {.softening = 125.0}, mpi::Comm(MPI_COMM_SELF), 1);
  const double time = least_time(seconds, [&] { solver->evaluate({position, mass}, acceleration, {}); });
  const std::vector<double> work = sim::gravity_work(*solver, 1);
  table.add(kMethodNames[method], "mixed", engine->stats(), time,
            1e-12 * std::accumulate(work.begin(), work.end(), 0.0));
}

}  // namespace

void run_work_bench(const WorkBenchOptions& options) {
  Table table(options.json);
  for (const Precision precision : {Precision::kMixed, Precision::kDouble}) {
    for (const WorkState& state : kStates) measure_steps(state, precision, options.seconds, table);
  }
  for (std::size_t m = 0; m < std::size(kMethods); ++m) measure_gravity(m, options.seconds, table);
  table.write();
}

}  // namespace breccia::bench

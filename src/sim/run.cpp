#include "sim/run.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>

#include "analysis/remnants.hpp"
#include "io/output_folder.hpp"
#include "io/remnants_json.hpp"
#include "io/snapshot.hpp"
#include "io/snapshot_series.hpp"
#include "sim/progress.hpp"
#include "sim/time_loop.hpp"

namespace breccia::sim {
namespace {

constexpr double kDefaultRows = 200.0;  // diagnostics rows of a run whose scene does not say how often

double target_mass(const Scene& scene) {
  double heaviest = 0.0;
  for (const BodyParameters& b : scene.bodies) heaviest = std::max(heaviest, b.mass);
  return heaviest;
}

// Output times are multiples of an interval; the step nearest to each is taken, so output never changes dt.
class Schedule {
 public:
  explicit Schedule(double interval) : interval_(interval), next_(interval > 0.0 ? interval : HUGE_VAL) {}
  bool due(double time, double dt) {
    if (time + 0.5 * dt < next_) return false;
    while (next_ <= time + 0.5 * dt) next_ += interval_;
    return true;
  }

 private:
  double interval_;
  double next_;
};

// Everything a run writes.
class Output {
 public:
  Output(const Scene& scene, const RunOptions& options, double end, Budget& budget, const mpi::Comm& comm)
      : scene_(scene),
        folder_(options.out),
        comm_(comm),
        budget_(budget),
        diagnostics_(folder_ / "diagnostics.csv", comm),
        snapshots_(scene.output.snapshot_interval),
        rows_(scene.output.diagnostics_interval > 0.0 ? scene.output.diagnostics_interval : end / kDefaultRows) {}

  // Writes what is due at this t_n; all of it at the first and the last one.
  void at(const TimeLoop& loop, bool force) {
    const bool snapshot = snapshots_.due(loop.time(), loop.dt()) || force;
    const bool row = rows_.due(loop.time(), loop.dt()) || force;
    const bool analysis = analysis_due(loop);
    if (!snapshot && !row && !analysis) return;
    loop.timers()("output", [&] {
      const ParticleOutput particles = loop.engine().observe();
      if (row) write_row(loop, particles);
      if (snapshot) write_snapshot(loop, particles);
      if (analysis) print_remnants(particles, loop.time());
    });
  }

  nlohmann::json remnants(const ParticleOutput& particles) const {
    const double link = scene_.output.link_cells * scene_.cell;
    const std::vector<double> potential = budget_.potential(particles);
    return io::remnants_json(analysis::find_fragments(particles, link, target_mass(scene_), comm_, potential).remnants);
  }
  [[nodiscard]] const io::DiagnosticsRow& last_row() const { return last_row_; }

 private:
  bool analysis_due(const TimeLoop& loop) {
    bool due = false;
    while (next_analysis_ < scene_.output.analysis_times.size() &&
           scene_.output.analysis_times[next_analysis_] <= loop.time() + 0.5 * loop.dt()) {
      ++next_analysis_;
      due = true;
    }
    return due;
  }

  void write_row(const TimeLoop& loop, const ParticleOutput& particles) {
    last_row_ = budget_.row(loop.engine(), particles, loop.lost_work());
    last_row_.time = loop.time();
    last_row_.step = loop.step();
    last_row_.dt = loop.dt();
    last_row_.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    diagnostics_.write(last_row_);
  }

  void write_snapshot(const TimeLoop& loop, const ParticleOutput& particles) {
    io::SnapshotHeader header;
    header.time = loop.time();
    header.step = loop.step();
    header.cell = scene_.cell;
    header.target_mass = target_mass(scene_);
    header.scene_name = scene_.name;
    const std::string name = io::snapshot_name(snapshot_number_++);
    io::write_snapshot(folder_ / name, header, particles, scene_.output.fields, comm_);
    io::add_to_series(folder_, name, loop.time(), comm_);
  }

  void print_remnants(const ParticleOutput& particles, double time) {
    const nlohmann::json found = remnants(particles);
    if (!comm_.is_root() || found.empty()) return;
    const auto& largest = found.front();
    fmt::print("t = {:.6g} s: {} remnants, largest M/M_target = {:.4f}, b/a = {:.3f}, c/a = {:.3f}, {}\n", time,
               found.size(), largest["mass_over_target"].get<double>(), largest["b_over_a"].get<double>(),
               largest["c_over_a"].get<double>(), largest["class"].get<std::string>());
  }

  const Scene& scene_;
  std::filesystem::path folder_;
  mpi::Comm comm_;
  Budget& budget_;
  io::DiagnosticsWriter diagnostics_;
  Schedule snapshots_;
  Schedule rows_;
  std::size_t next_analysis_ = 0;
  std::uint64_t snapshot_number_ = 0;
  io::DiagnosticsRow last_row_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void print_profile(const StageTimers& timers, const GravityRecord& gravity, double wall) {
  fmt::print("{:<20} {:>10} {:>7} {:>10}\n", "stage", "seconds", "%", "calls");
  for (const StageTimers::Stage& s : timers.stages()) {
    fmt::print("{:<20} {:>10.3f} {:>7.1f} {:>10}\n", s.name, s.seconds, 100.0 * s.seconds / wall, s.calls);
  }
  if (!gravity.decision().empty()) fmt::print("gravity at the end: {}\n", gravity.decision());
}

std::filesystem::path default_folder(const Scene& scene) { return std::filesystem::path("out") / scene.name; }

}  // namespace

void run(const Scene& scene, const RunOptions& options_in, const mpi::Comm& comm) {
  RunOptions options = options_in;
  if (options.out.empty()) options.out = default_folder(scene);
  io::prepare_output_folder(options.out, comm);

  const double end = options.until.value_or(scene.time.end);
  const ResolvedEffects effects = resolve_effects(scene);
  TimeLoop loop(scene, effects, options.threads, comm);
  Budget budget(loop.solver(), scene.gravity.uniform, comm);
  Output output(scene, options, end, budget, comm);
  std::uint64_t particles = 0;
  for (const BodyParameters& b : scene.bodies) particles += b.particles;
  io::RunSummary summary;
  const auto start = std::chrono::steady_clock::now();
  {
    Progress progress(end, options.steps.value_or(0), particles, comm);
    loop.run([&](const TimeLoop& now) {
      const bool last = now.time() + 0.5 * now.dt() >= end || (options.steps && now.step() >= *options.steps);
      output.at(now, last || now.step() == 0);
      progress.update(now.time(), now.step(), now.dt());
      return !last;
    });
  }
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  summary.particles = particles;
  summary.steps = loop.step();
  summary.simulated_time = loop.time();
  summary.ranks = comm.size();
  summary.threads = options.threads;
  summary.precision = scene.numerics.precision == Precision::kDouble ? "double" : "mixed";
  summary.conservation = budget.drift();
  summary.damaged_fraction = output.last_row().damaged_fraction;
  summary.remnants = output.remnants(loop.engine().observe());
  summary.wall_seconds = wall;
  for (const StageTimers::Stage& s : loop.timers().stages()) {
    summary.stages.push_back({s.name, s.seconds, s.calls});
    if (s.name == "output") summary.wall_seconds -= s.seconds;
  }
  summary.gravity = loop.gravity_record().summary(comm);
  summary.scene = options.resolved;
  io::write_summary(options.out / "summary.json", summary, comm);
  if (options.profile && comm.is_root()) print_profile(loop.timers(), loop.gravity_record(), wall);
}

}  // namespace breccia::sim

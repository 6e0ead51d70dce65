#include "sim/run.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <utility>

#include "analysis/remnants.hpp"
#include "breccia/error.hpp"
#include "io/collectively.hpp"
#include "io/output_folder.hpp"
#include "io/remnants_json.hpp"
#include "io/snapshot.hpp"
#include "io/snapshot_series.hpp"
#include "sim/checkpoints.hpp"
#include "sim/dump.hpp"
#include "sim/own_folder.hpp"
#include "sim/progress.hpp"
#include "sim/stop_requests.hpp"
#include "sim/time_loop.hpp"
#include "sim/timeline_file.hpp"

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
  // Goes on after a restart at `time`, also where the scene asks for another interval now.
  void restore(const ScheduleState& state, double time) {
    if (state.interval == interval_) {
      next_ = state.next;
    } else if (interval_ > 0.0) {
      next_ = interval_ * std::max(1.0, std::ceil(time / interval_));
    }
  }
  [[nodiscard]] ScheduleState state() const { return {interval_, next_}; }
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
  Output(const Scene& scene, const RunOptions& options, double end, const std::optional<Restart>& restart,
         Budget& budget, const mpi::Comm& comm)
      : scene_(scene),
        folder_(options.out),
        comm_(comm),
        budget_(budget),
        diagnostics_(restart ? io::DiagnosticsWriter(folder_ / "diagnostics.csv", restart->run.loop.step, comm)
                             : io::DiagnosticsWriter(folder_ / "diagnostics.csv", comm)),
        snapshots_(scene.output.snapshot_interval),
        rows_(scene.output.diagnostics_interval > 0.0 ? scene.output.diagnostics_interval : end / kDefaultRows) {
    if (!restart) return;
    const OutputState& state = restart->run.output;
    snapshots_.restore(state.snapshots, restart->run.loop.time);
    rows_.restore(state.rows, restart->run.loop.time);
    next_analysis_ = state.next_analysis;
    snapshot_number_ = state.snapshot_number;
    last_row_ = restart->run.budget.first;
    io::cut_series(folder_, snapshot_number_, comm_);
  }

  [[nodiscard]] OutputState state() const {
    return {snapshots_.state(), rows_.state(), next_analysis_, snapshot_number_, 0.0};
  }
  // A snapshot at the next t_n, whether due or not.
  void want_snapshot() { snapshot_wanted_ = true; }

  // Writes what is due at this t_n; all of it at the first and the last one.
  void at(const TimeLoop& loop, bool force) {
    const bool snapshot = snapshots_.due(loop.time(), loop.dt()) || force || std::exchange(snapshot_wanted_, false);
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
    const std::uint64_t clamped_before = last_row_.clamped_volumes;
    last_row_ = budget_.row(loop.engine(), particles, loop.lost_work());
    if (clamped_before == 0 && last_row_.clamped_volumes > 0) warn_of_clamped(loop.time());
    last_row_.time = loop.time();
    last_row_.step = loop.step();
    last_row_.dt = loop.dt();
    last_row_.imbalance = loop.balance().imbalance;
    last_row_.recuts = loop.balance().recuts;
    last_row_.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    diagnostics_.write(last_row_);
  }

  void warn_of_clamped(double time) const {
    if (!comm_.is_root()) return;
    fmt::print(
        stderr,
        "breccia: warning: until t = {:.6g} s, {} volume changes of a particle were cut, the grid asking for "
        "det(I + dt L) <= 0.1 in one step; clamped_volumes in diagnostics.csv counts them, a smaller time.step or "
        "time.cfl avoids them\n",
        time, last_row_.clamped_volumes);
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
  bool snapshot_wanted_ = false;
  io::DiagnosticsRow last_row_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

std::optional<io::HaloTiming> halo_timing(const grid::Engine& engine, const mpi::Comm& comm) {
  if (comm.size() == 1) return std::nullopt;
  const grid::EngineStats stats = engine.stats();
  io::HaloTiming halo;
  halo.in_flight_seconds = comm.sum(stats.halo_in_flight);
  halo.waited_seconds = comm.sum(stats.halo_waited);
  if (halo.in_flight_seconds > 0.0) halo.hidden_fraction = 1.0 - halo.waited_seconds / halo.in_flight_seconds;
  halo.bytes_per_step = comm.sum(stats.halo_bytes_per_step);
  halo.key_exchanges = comm.max(stats.key_exchanges);
  return halo;
}

void print_halo(const io::HaloTiming& halo) {
  fmt::print("messages of nodes: {:.1f} % of their {:.3g} s under way hidden behind other work, {:.3g} s waited\n",
             100.0 * halo.hidden_fraction, halo.in_flight_seconds, halo.waited_seconds);
  fmt::print("  all ranks: {:.3g} MB a step; keys exchanged at {} sortings\n",
             1e-6 * static_cast<double>(halo.bytes_per_step), halo.key_exchanges);
}

void print_profile(const StageTimers& timers, const std::string& decision, const nlohmann::json& gravity, double wall) {
  fmt::print("{:<20} {:>10} {:>7} {:>10}\n", "stage", "seconds", "%", "calls");
  for (const StageTimers::Stage& s : timers.stages()) {
    fmt::print("{:<20} {:>10.3f} {:>7.1f} {:>10}\n", s.name, s.seconds, 100.0 * s.seconds / wall, s.calls);
  }
  if (gravity.is_null()) return;
  fmt::print("gravity at the end: {}\n", decision);
  const auto number = [&](const char* key) { return gravity[key].get<double>(); };
  fmt::print("  all ranks: {:.3g} pairs, {:.3g} particles with cells, {:.3g} cells with cells, {:.3g} MB sent\n",
             number("pairs"), number("cell_interactions"), number("expansions"), 1e-6 * number("bytes_sent"));
  fmt::print("  {} boxes; at most {:.3g} cells and {:.3g} particles of other ranks' trees; net force removed {:.1e}\n",
             gravity["boxes"].get<int>(), number("cells_imported"), number("particles_imported"), number("net_force"));
}

nlohmann::json slabs_json(const TimeLoop& loop, const mpi::Comm& comm) {
  const BalanceState& balance = loop.balance();
  const auto windows = static_cast<double>(balance.windows);
  const std::uint64_t bytes = loop.engine().stats().halo_bytes_per_step;
  return {{"axis", std::string(1, "xyz"[loop.engine().slabs().axis()])},
          {"imbalance_mean", balance.windows > 0 ? balance.imbalance_sum / windows : 1.0},
          {"imbalance_max", balance.imbalance_max},
          {"imbalance", balance.imbalance},
          {"recuts", balance.recuts},
          {"windows", balance.windows},
          {"halo_bytes_mean", static_cast<double>(comm.sum(bytes)) / comm.size()},
          {"halo_bytes_max", comm.max(bytes)}};
}

void print_slabs(const nlohmann::json& slabs) {
  const auto number = [&](const char* key) { return slabs[key].get<double>(); };
  fmt::print(
      "slabs across {}: imbalance of the counted work {:.3f} on average, {:.3f} at most; cut anew {} times in {} "
      "windows; {:.3g} kB of halo sent by a rank in a step, {:.3g} at most\n",
      slabs["axis"].get<std::string>(), number("imbalance_mean"), number("imbalance_max"),
      slabs["recuts"].get<std::uint64_t>(), slabs["windows"].get<std::uint64_t>(), 1e-3 * number("halo_bytes_mean"),
      1e-3 * number("halo_bytes_max"));
}

std::filesystem::path default_folder(const Scene& scene) { return std::filesystem::path("out") / scene.name; }

// A run's end as its summary.json has it: nothing is left to do if it reached this one.
bool finished(const std::filesystem::path& folder, double end, const RunOptions& options, const mpi::Comm& comm) {
  bool done = false;
  io::on_root(comm, [&] {
    std::ifstream file(folder / "summary.json");
    if (!file) return;
    const nlohmann::json summary = nlohmann::json::parse(file, nullptr, false);
    if (summary.is_discarded() || !summary.contains("time_step")) return;
    const double reached = summary.value("simulated_time", 0.0) + 0.5 * summary.value("time_step", 0.0);
    done = reached >= end || (options.steps && summary.value("steps", std::uint64_t{0}) >= *options.steps);
  });
  return comm.any(done);
}

std::unique_ptr<TimeLoop> make_loop(const Scene& scene, const std::optional<Restart>& restart, int threads,
                                    grid::EngineMaker make, const mpi::Comm& comm) {
  const ResolvedEffects effects = resolve_effects(scene);
  if (!restart) return std::make_unique<TimeLoop>(scene, effects, threads, comm, make);
  std::unique_ptr<TimeLoop> loop;
  io::collectively(comm, [&] {
    loop = std::make_unique<TimeLoop>(scene, effects, restart->engine, restart->run.loop, threads, comm, make);
  });
  return loop;
}

// Only the host engine adds in an order that does not depend on the ranks.
grid::Device device_for(const Scene& scene, grid::Device wanted) {
  if (!scene.numerics.reproducible) return wanted;
  if (wanted == grid::Device::kCuda) {
    throw UsageError(
        "numerics.reproducible: the same bits on any number of ranks come from the host engine only; run "
        "with --device host, or without the key");
  }
  return grid::Device::kHost;
}

void print_device(const grid::EngineChoice& engine, const mpi::Comm& comm) {
  if (!comm.is_root()) return;
  if (!engine.warning.empty()) fmt::print(stderr, "breccia: warning: {}\n", engine.warning);
  if (engine.reason.empty()) return;
  fmt::print("device: {} ({})\n", engine.device, engine.reason);
}

// What happens where a window begins: checkpoints, and the end of a run that is told to stop.
class Interruptions {
 public:
  Interruptions(const RunOptions& options, const Scene& scene, double time, Output& output, const Budget& budget,
                double wall_before, std::uint64_t first_checkpoint, const mpi::Comm& comm)
      : options_(options),
        output_(output),
        budget_(budget),
        wall_before_(wall_before),
        requests_(options.out, options.walltime, start_, comm),
        checkpoints_(options.out, scene.output, time, first_checkpoint, comm) {}

  // False if the run is to stop.
  bool at_window_start(const TimeLoop& loop) {
    const auto now = Clock::now();
    longest_window_ = std::max(longest_window_, std::chrono::duration<double>(now - window_start_).count());
    const Requests requests = requests_.poll(kSafety * (longest_window_ + checkpoints_.seconds()) + kSlack);
    if (requests.snapshot) output_.want_snapshot();
    if (requests.stop != nullptr || checkpoints_.due(loop.time())) {
      loop.timers()("checkpoint", [&] { write(loop); });
    }
    if (requests.stop != nullptr) {
      stopped_ = fmt::format("stopped at t = {:.6g} s, step {}, because {}; {} is written, --restart auto continues",
                             loop.time(), loop.step(), requests.stop, name_);
    }
    window_start_ = Clock::now();
    return stopped_.empty();
  }

  // Ends the program if the run was stopped.
  void end_if_stopped() const {
    if (!stopped_.empty()) throw Error(ExitCode::kStopped, stopped_);
  }

 private:
  using Clock = std::chrono::steady_clock;
  // A window and a checkpoint may take longer than the last ones did.
  static constexpr double kSafety = 1.5;
  static constexpr double kSlack = 1.0;  // [s]

  void write(const TimeLoop& loop) {
    RunState run{loop.state(), budget_.state(), output_.state(), options_.resolved};
    run.output.wall_seconds = wall_before_ + std::chrono::duration<double>(Clock::now() - start_).count();
    name_ = checkpoints_.write(loop.engine().save(), run);
  }

  const RunOptions& options_;
  Output& output_;
  const Budget& budget_;
  double wall_before_;
  Clock::time_point start_ = Clock::now();
  StopRequests requests_;
  Checkpoints checkpoints_;
  Clock::time_point window_start_ = start_;
  double longest_window_ = 0.0;
  std::string name_;
  std::string stopped_;
};

}  // namespace

void run(const Scene& scene, const RunOptions& options_in, const mpi::Comm& comm) {
  RunOptions options = options_in;
  if (options.out.empty()) options.out = default_folder(scene);
  const double end = options.until.value_or(scene.time.end);
  const grid::EngineChoice engine = grid::choose_engine(device_for(scene, options.device), comm);
  std::optional<Restart> restart;
  if (options.restart.empty()) {
    io::prepare_output_folder(options.out, comm);
  } else {
    require_own_folder(options.out, scene, options.resolved, comm);
    if (options.restart == "auto" && finished(options.out, end, options, comm)) {
      if (comm.is_root()) fmt::print("{}: this run is finished\n", options.out.string());
      return;
    }
    io::continue_output_folder(options.out, comm);
    restart = find_restart(options.restart, options.out, scene, options.resolved, comm);
  }

  const std::unique_ptr<TimeLoop> owned = make_loop(scene, restart, options.threads, engine.make, comm);
  TimeLoop& loop = *owned;
  print_device(engine, comm);
  Budget budget(loop.solver(), scene.gravity.uniform, comm, scene.numerics.energy_gain);
  if (restart) budget.restore(restart->run.budget);
  Output output(scene, options, end, restart, budget, comm);
  const double wall_before = restart ? restart->run.output.wall_seconds : 0.0;
  const std::uint64_t first_checkpoint = restart ? restart->next_number : 0;
  restart.reset();
  std::uint64_t particles = 0;
  for (const BodyParameters& b : scene.bodies) particles += b.particles;
  io::RunSummary summary;
  Timeline timeline;
  const Timeline::Clock::time_point timeline_start = common_start(comm);
  if (!options.timeline.empty()) loop.record(timeline);
  const auto start = std::chrono::steady_clock::now();
  {
    Interruptions interruptions(options, scene, loop.time(), output, budget, wall_before, first_checkpoint, comm);
    Progress progress(loop.time(), loop.step(), end, options.steps.value_or(0), particles, comm);
    try {
      loop.run(
          [&](const TimeLoop& now) {
            const bool last = now.time() + 0.5 * now.dt() >= end || (options.steps && now.step() >= *options.steps);
            output.at(now, last || now.step() == 0);
            progress.update(now.time(), now.step(), now.dt());
            return !last;
          },
          [&](const TimeLoop& now) { return interruptions.at_window_start(now); });
    } catch (const NumericsError& error) {
      throw NumericsError(dump(loop, scene, error.what(), options.out, comm));
    }
    interruptions.end_if_stopped();
  }
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  summary.particles = particles;
  summary.steps = loop.step();
  summary.simulated_time = loop.time();
  summary.ranks = comm.size();
  summary.threads = options.threads;
  summary.device = engine.device;
  summary.precision = scene.numerics.precision == Precision::kDouble ? "double" : "mixed";
  summary.conservation = budget.drift();
  summary.damaged_fraction = output.last_row().damaged_fraction;
  summary.clamped_volumes = output.last_row().clamped_volumes;
  summary.remnants = output.remnants(loop.engine().observe());
  summary.time_step = loop.dt();
  summary.wall_seconds = wall_before + wall;
  for (const StageTimers::Stage& s : loop.timers().stages()) {
    summary.stages.push_back({s.name, s.seconds, s.calls});
    if (s.name == "output" || s.name == "checkpoint") summary.wall_seconds -= s.seconds;
  }
  summary.halo = halo_timing(loop.engine(), comm);
  summary.gravity = loop.gravity_record().summary(comm);
  summary.slabs = slabs_json(loop, comm);
  summary.scene = options.resolved;
  io::write_summary(options.out / "summary.json", summary, comm);
  if (options.profile && comm.is_root()) {
    print_profile(loop.timers(), loop.gravity_record().decision(), summary.gravity, wall);
    if (summary.halo) print_halo(*summary.halo);
    if (comm.size() > 1) print_slabs(summary.slabs);
  }
  if (!options.timeline.empty()) write_timeline(options.timeline, timeline, timeline_start, comm);
}

}  // namespace breccia::sim

#include "sim/run.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <fstream>

#include "breccia/error.hpp"
#include "io/collectively.hpp"
#include "io/output_folder.hpp"
#include "sim/checkpoints.hpp"
#include "sim/dump.hpp"
#include "sim/interruptions.hpp"
#include "sim/output.hpp"
#include "sim/own_folder.hpp"
#include "sim/progress.hpp"
#include "sim/ranks_report.hpp"
#include "sim/time_loop.hpp"
#include "sim/timeline_file.hpp"

namespace breccia::sim {
namespace {

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
  if (!engine.messages.empty()) fmt::print("messages between devices: {}\n", engine.messages);
}

}  // namespace

void run(const Scene& scene, const RunOptions& options_in, const mpi::Comm& comm) {
  RunOptions options = options_in;
  if (options.out.empty()) options.out = default_folder(scene);
  const double end = options.until.value_or(scene.time.end);
  const grid::EngineChoice engine =
      grid::choose_engine(device_for(scene, options.device), comm, scene.parallel.device_messages);
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
  Budget budget(loop.solver(), scene, comm);
  if (restart) budget.restore(restart->run.budget);
  Output output(scene, options.out, end, restart, budget, comm);
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

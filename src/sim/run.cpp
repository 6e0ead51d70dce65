#include "sim/run.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>

#include "breccia/error.hpp"
#include "io/collectively.hpp"
#include "sim/beginning.hpp"
#include "sim/dump.hpp"
#include "sim/interruptions.hpp"
#include "sim/output.hpp"
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
  const grid::EngineChoice engine = grid::choose_engine(device_for(scene, options.device), scene.numerics.precision,
                                                        comm, scene.parallel.device_messages);
  Beginning beginning = begin(scene, options, end, comm);
  if (beginning.finished) return;
  std::optional<Restart>& restart = beginning.restart;

  const std::unique_ptr<TimeLoop> owned = make_loop(scene, restart, options.threads, engine.make, comm);
  TimeLoop& loop = *owned;
  print_device(engine, comm);
  Budget budget(loop.solver(), scene, comm);
  if (restart) budget.restore(restart->run.budget);
  // From here on the end that was is none.
  io::remove_summary(options.out / "summary.json", comm);
  Output output(scene, options.out, end, options.resolved, restart, budget, comm);
  const double wall_before = restart ? restart->run.output.wall_seconds : 0.0;
  const std::uint64_t first_checkpoint = restart ? restart->next_number : 0;
  restart.reset();
  std::uint64_t particles = 0;
  for (const BodyParameters& b : scene.bodies) particles += b.particles;
  io::RunSummary summary;
  Timeline timeline;
  const Timeline::Clock::time_point timeline_start = common_start(comm);
  if (!options.timeline.empty()) loop.record(timeline);
  // After so many more steps of the present length.
  const auto ends_after = [&](const TimeLoop& now, int steps) {
    return now.time() + (steps + 0.5) * now.dt() >= end ||
           (options.steps && now.step() + static_cast<std::uint64_t>(steps) >= *options.steps);
  };
  const auto start = std::chrono::steady_clock::now();
  {
    Interruptions interruptions(options, scene, loop.time(), output, budget, wall_before, first_checkpoint, comm);
    Progress progress(loop.time(), loop.step(), end, options.steps.value_or(0), particles, comm);
    try {
      loop.run(
          [&](const TimeLoop& now) {
            const bool last = ends_after(now, 0);
            output.at(now, last || now.step() == 0);
            progress.update(now.time(), now.step(), now.dt());
            return !last;
          },
          [&](const TimeLoop& now) {
            return interruptions.at_window_start(now, ends_after(now, scene.gravity.interval - 1));
          });
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

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <regex>
#include <string>

#include "breccia/error.hpp"
#include "cli/command.hpp"
#include "cli/scene_options.hpp"
#include "scene/units.hpp"
#include "sim/run.hpp"
#include "sim/stop_requests.hpp"

namespace breccia::cli {
namespace {

// When the program began, before MPI did.
const auto kStart = std::chrono::steady_clock::now();

struct Options {
  SceneOptions scene;
  std::string out;
  std::string until;
  std::optional<std::uint64_t> steps;
  std::string device = "auto";
  int threads = 1;
  std::string restart;
  std::string walltime;
  bool profile = false;
  std::string timeline;
};

double parse_until(const std::string& text) {
  try {
    return scene::parse_quantity(text, scene::kTime);
  } catch (const UsageError& error) {
    throw UsageError("--until: " + std::string(error.what()));
  }
}

// "hh:mm:ss", also "mm:ss" or "ss" [s].
double parse_walltime(const std::string& text) {
  static const std::regex kForm("(?:(?:(\\d+):)?(\\d+):)?(\\d+)");
  std::smatch parts;
  if (!std::regex_match(text, parts, kForm)) {
    throw UsageError("--walltime: \"" + text + "\" is no time; write hours, minutes and seconds: 12:00:00");
  }
  const auto number = [&](std::size_t i) { return parts[i].matched ? std::stod(parts[i].str()) : 0.0; };
  return 3600.0 * number(1) + 60.0 * number(2) + number(3);
}

grid::Device device_named(const std::string& name) {
  if (name == "cuda") return grid::Device::kCuda;
  return name == "host" ? grid::Device::kHost : grid::Device::kAuto;
}

void run(const Options& options, const mpi::Comm& comm) {
  sim::keep_stop_signals();
  sim::RunOptions run_options;
  run_options.started = kStart;
  run_options.out = options.out;
  if (!options.until.empty()) run_options.until = parse_until(options.until);
  run_options.steps = options.steps;
  run_options.restart = options.restart;
  if (!options.walltime.empty()) run_options.walltime = parse_walltime(options.walltime);
  run_options.threads = options.threads;
  run_options.device = device_named(options.device);
  run_options.profile = options.profile;
  run_options.timeline = options.timeline;
  scene::LoadedScene loaded = load(options.scene, comm);
  run_options.resolved = std::move(loaded.keys);
  sim::run(loaded.scene, run_options, comm);
}

}  // namespace

void add_run(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("run", "Run a scene, alone or under mpirun");
  const auto options = std::make_shared<Options>();
  add_scene_options(command, options->scene);
  command.add_option("--out", options->out, "Output folder, new or empty [out/<scene name>]")->type_name("DIR");
  command
      .add_option("--restart", options->restart,
                  "Continue from the newest checkpoint in the output folder (auto; a new run if there is none) or from "
                  "this file")
      ->type_name("auto|FILE");
  command
      .add_option("--walltime", options->walltime,
                  "Write a checkpoint and end with exit code 75 before this much wall time is over")
      ->type_name("hh:mm:ss");
  command.add_option("--until", options->until, "End at this simulated time instead, e.g. \"2000 s\"")
      ->type_name("TIME");
  command.add_option("--steps", options->steps, "End after this many steps")
      ->check(CLI::NonNegativeNumber)
      ->option_text("N");
  command.add_option("--device", options->device, "Where to compute")
      ->check(CLI::IsMember({"auto", "host", "cuda"}))
      ->option_text("auto|host|cuda");
  command.add_option("--threads", options->threads, "Threads of each rank [1]")
      ->check(CLI::PositiveNumber)
      ->option_text("N");
  command.add_flag("--profile", options->profile, "Print the time of each stage at the end");
  command
      .add_option("--timeline", options->timeline,
                  "Write what each rank did when in the last 100 steps or more, for Perfetto, chrome://tracing or "
                  "tools/plot-timeline")
      ->type_name("FILE");
  command.callback([options, &action] { action = [options](const mpi::Comm& comm) { run(*options, comm); }; });
}

}  // namespace breccia::cli

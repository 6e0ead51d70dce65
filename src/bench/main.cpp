// breccia_bench: the measurements behind tools/bench.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>

#include "bench/engine_bench.hpp"
#include "bench/gravity_bench.hpp"
#include "bench/message_bench.hpp"
#include "bench/work_bench.hpp"
#include "breccia/error.hpp"
#include "mpi/comm.hpp"

namespace {

// What keeps a file from being written, if anything: asked before minutes of measurements, not after them. Collective;
// rank 0 writes, and others need not see its folder.
std::string obstacle(const std::string& file) {
  const breccia::mpi::Comm comm;
  const auto is_folder = [](const std::filesystem::path& path) {
    std::error_code unreadable;
    return std::filesystem::is_directory(path, unreadable);
  };
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  if (comm.any(comm.is_root() && is_folder(file))) return file + ": is a folder";
  if (comm.any(comm.is_root() && !folder.empty() && !is_folder(folder))) return file + ": its folder does not exist";
  return {};
}

void add_json(CLI::App& command, std::string& file) {
  command.add_option("--json", file, "file for the results, - for standard output")
      ->check(CLI::Validator(obstacle, "FILE"));
}

int measure(int argc, char** argv) {
  CLI::App app("Measures the speed of breccia on this machine");
  app.require_subcommand(1);
  breccia::bench::EngineBenchOptions options;
  CLI::App* engine = app.add_subcommand("engine", "particle-steps per second of the engine");
  engine->add_flag("--quick", options.quick, "the paper's state with all effects only, half a minute");
  engine->add_option("--case", options.cases,
                     "paper, debris, cell8_1e4, cell8_1e5, cell8_1e6, cell8_1e7, broken_1e6, paper_1e6, paper_3e6, "
                     "debris_1e6");
  engine->add_option("--effects", options.effects, "all, or one of those 'no ...'");
  engine->add_option("--precision", options.precision, "mixed or double")->check(CLI::IsMember({"mixed", "double"}));
  engine->add_option("--cores", options.cores, "numbers of threads")->check(CLI::PositiveNumber);
  engine->add_option("--device", options.device, "host or cuda")->check(CLI::IsMember({"host", "cuda"}));
  engine->add_option("--seconds", options.seconds, "least time of a measurement")->capture_default_str();
  engine->add_flag("--reproducible", options.reproducible, "each state also with numerics.reproducible: its price");
  add_json(*engine, options.json);
  breccia::bench::GravityBenchOptions gravity_options;
  CLI::App* gravity = app.add_subcommand("gravity", "time and error of self-gravity");
  gravity->add_flag("--quick", gravity_options.quick, "94,648 particles only");
  gravity->add_option("--states", gravity_options.states, "some of a, b, c, n, f, p, q");
  gravity->add_option("--methods", gravity_options.methods, "some of direct (of a device), tree, treepm, auto")
      ->check(CLI::IsMember({"direct", "tree", "treepm", "auto"}));
  gravity->add_option("--particles", gravity_options.particles, "numbers of particles");
  gravity->add_option("--opening", gravity_options.openings, "tolerances of the tree");
  gravity->add_flag("--body", gravity_options.body, "net force on the first body at a million particles too: a minute");
  gravity->add_option("--threads", gravity_options.threads, "threads");
  gravity->add_option("--device", gravity_options.device, "host or cuda")->check(CLI::IsMember({"host", "cuda"}));
  gravity->add_option("--precision", gravity_options.precision, "of the device's sums: mixed or double")
      ->check(CLI::IsMember({"mixed", "double"}));
  gravity->add_option("--pairs", gravity_options.pairs, "evaluations per setting; the best counts");
  add_json(*gravity, gravity_options.json);
  breccia::bench::WorkBenchOptions work_options;
  CLI::App* work = app.add_subcommand("work", "time against the counted work by which slabs are balanced");
  work->add_option("--seconds", work_options.seconds, "least time of a measurement")->capture_default_str();
  add_json(*work, work_options.json);
  breccia::bench::MessageBenchOptions message_options;
  CLI::App* messages = app.add_subcommand("messages", "latency and bandwidth between two ranks");
  add_json(*messages, message_options.json);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : static_cast<int>(breccia::ExitCode::kUsage);
  }
  if (engine->parsed()) breccia::bench::run_engine_bench(options);
  if (gravity->parsed()) breccia::bench::run_gravity_bench(gravity_options);
  if (messages->parsed()) breccia::bench::run_message_bench(message_options);
  if (work->parsed()) breccia::bench::run_work_bench(work_options);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const breccia::mpi::Environment environment(&argc, &argv);
  try {
    return measure(argc, argv);
  } catch (const breccia::Error& e) {
    std::fprintf(stderr, "breccia_bench: error: %s\n", e.what());
    return static_cast<int>(e.code());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "breccia_bench: error: %s\n", e.what());
    return static_cast<int>(breccia::ExitCode::kNumerics);
  }
}

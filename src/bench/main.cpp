// breccia_bench: the measurements behind tools/bench.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "bench/engine_bench.hpp"
#include "bench/gravity_bench.hpp"
#include "breccia/error.hpp"
#include "mpi/comm.hpp"

int main(int argc, char** argv) {
  const breccia::mpi::Environment environment(&argc, &argv);
  CLI::App app("Measures the speed of breccia on this machine");
  app.require_subcommand(1);
  breccia::bench::EngineBenchOptions options;
  CLI::App* engine = app.add_subcommand("engine", "particle-steps per second of the host engine");
  engine->add_flag("--quick", options.quick, "small cases only, about a minute");
  engine->add_option("--json", options.json, "file for the results, - for standard output");
  breccia::bench::GravityBenchOptions gravity_options;
  CLI::App* gravity = app.add_subcommand("gravity", "time and error of self-gravity");
  gravity->add_flag("--quick", gravity_options.quick, "94,648 particles only");
  gravity->add_option("--states", gravity_options.states, "some of a, b, c");
  gravity->add_option("--particles", gravity_options.particles, "numbers of particles");
  gravity->add_option("--opening", gravity_options.openings, "tolerances of the tree");
  gravity->add_option("--threads", gravity_options.threads, "threads");
  gravity->add_option("--pairs", gravity_options.pairs, "evaluations per setting; the best counts");
  gravity->add_option("--json", gravity_options.json, "file for the results, - for standard output");
  try {
    app.parse(argc, argv);
    if (engine->parsed()) breccia::bench::run_engine_bench(options);
    if (gravity->parsed()) breccia::bench::run_gravity_bench(gravity_options);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : static_cast<int>(breccia::ExitCode::kUsage);
  } catch (const breccia::Error& e) {
    std::fprintf(stderr, "breccia_bench: error: %s\n", e.what());
    return static_cast<int>(e.code());
  }
  return 0;
}

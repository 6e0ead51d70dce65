// breccia_bench: the measurements behind tools/bench.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "bench/engine_bench.hpp"
#include "breccia/error.hpp"
#include "mpi/comm.hpp"

int main(int argc, char** argv) {
  const breccia::mpi::Environment environment(&argc, &argv);
  CLI::App app("Measures the speed of breccia on this machine");
  app.require_subcommand(1);
  breccia::bench::EngineBenchOptions options;
  CLI::App* engine = app.add_subcommand("engine", "particle-steps per second of the host engine");
  engine->add_flag("--quick", options.quick, "the paper's state with all effects only, half a minute");
  engine->add_option("--case", options.cases, "paper, debris, cell8_1e5, cell8_1e6, cell8_1e7");
  engine->add_option("--effects", options.effects, "all, or one of those 'no ...'");
  engine->add_option("--precision", options.precision, "mixed or double")->check(CLI::IsMember({"mixed", "double"}));
  engine->add_option("--cores", options.cores, "numbers of threads")->check(CLI::PositiveNumber);
  engine->add_option("--seconds", options.seconds, "least time of a measurement")->capture_default_str();
  engine->add_option("--json", options.json, "file for the results, - for standard output");
  try {
    app.parse(argc, argv);
    breccia::bench::run_engine_bench(options);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : static_cast<int>(breccia::ExitCode::kUsage);
  } catch (const breccia::Error& e) {
    std::fprintf(stderr, "breccia_bench: error: %s\n", e.what());
    return static_cast<int>(e.code());
  }
  return 0;
}

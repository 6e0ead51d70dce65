#include <csignal>
#include <iostream>
#include <string>

#include "breccia/error.hpp"
#include "cli/command.hpp"
#include "cli/exit_status.hpp"

namespace breccia::cli {
namespace {

void run_command_line(int argc, char** argv, const mpi::Comm& comm) {
  CLI::App app("breccia: slow collisions of self-gravitating rocky bodies with the material point method.", "breccia");
  app.set_version_flag("--version", std::string("breccia ") + BRECCIA_VERSION);
  app.require_subcommand(0, 1);
  app.footer(
      "`breccia COMMAND --help` explains one command. Exit codes: 0 done, 2 wrong use or scene,\n"
      "3 the numbers went wrong, 4 input or output, 75 stopped early, to be continued with --restart auto.");

  Action action;
  add_run(app, action);
  add_check(app, action);
  add_analyze(app, action);
  add_eos(app, action);
  add_gravity(app, action);
  add_info(app, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& request) {  // --help, --version
    if (comm.is_root()) app.exit(request, std::cout, std::cerr);
    return;
  } catch (const CLI::ParseError& error) {
    throw UsageError(std::string(error.what()) + "; see breccia --help");
  }
  if (!action) throw UsageError("say what to do: run, check, analyze, gravity, eos or info; see breccia --help");
  action(comm);
}

}  // namespace
}  // namespace breccia::cli

int main(int argc, char** argv) {
  // A file that may not grow is an error of input and output like a full disk, not the end without a word.
  std::signal(SIGXFSZ, SIG_IGN);
  const breccia::mpi::Environment environment(&argc, &argv);
  const breccia::mpi::Comm comm;
  return breccia::cli::exit_status([&] { breccia::cli::run_command_line(argc, argv, comm); }, comm);
}

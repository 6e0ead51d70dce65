// The commands of breccia, one file each. Options are declared and checked here; what they mean is done by sim and
// below.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

#include "mpi/comm.hpp"

namespace breccia::cli {

/// What the parsed command line asks for. Collective; throws breccia::Error, the same on all ranks.
using Action = std::function<void(const mpi::Comm&)>;

/// Each adds its subcommand to `app`; parsing that subcommand sets `action`, which must outlive `app`.
void add_run(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);
void add_analyze(CLI::App& app, Action& action);
void add_eos(CLI::App& app, Action& action);
void add_gravity(CLI::App& app, Action& action);
void add_info(CLI::App& app, Action& action);

}  // namespace breccia::cli

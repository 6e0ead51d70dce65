#include "sim/beginning.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "breccia/error.hpp"
#include "io/collectively.hpp"
#include "io/output_folder.hpp"
#include "sim/old_results.hpp"

namespace breccia::sim {
namespace {

namespace fs = std::filesystem;

bool reaches_end(const OldResults& old, double end, const std::optional<std::uint64_t>& steps) {
  return old.ended && (old.reached >= end || (steps && old.steps >= *steps));
}

// What was asked for while the last run came to its end would stop this one at its first window.
void remove_stale_stop(const fs::path& folder, const mpi::Comm& comm) {
  io::on_root(comm, [&] {
    const fs::path stop = folder / "stop";
    if (fs::remove(stop)) fmt::print(stderr, "breccia: {} was there before this run: removed\n", stop.string());
  });
}

// A run that ended is a result, unless it did so in its first window, which has no checkpoint and costs nothing.
void require_repeatable(const OldResults& old, const fs::path& folder) {
  if (old.headless) {
    throw UsageError(
        fmt::format("output folder {} holds a run without a checkpoint of its own, which did not begin there: name the "
                    "checkpoint that it began at with --restart FILE, or another folder with --out",
                    folder.string()));
  }
  if (!old.ended || old.steps <= old.window) return;
  throw UsageError(
      fmt::format("output folder {} holds a run that ended at step {} without a checkpoint, so that it cannot go on: "
                  "name another folder with --out for one from the start",
                  folder.string(), old.steps));
}

}  // namespace

Beginning begin(const Scene& scene, const RunOptions& options, double end, const mpi::Comm& comm) {
  if (options.restart.empty()) {
    io::prepare_output_folder(options.out, comm);
    return {};
  }
  const OldResults old = old_results(options.out, scene, options.resolved, comm);
  if (options.restart == "auto" && reaches_end(old, end, options.steps)) {
    if (comm.is_root()) fmt::print("{}: this run is finished\n", options.out.string());
    return {true, {}};
  }
  io::continue_output_folder(options.out, comm);
  Beginning beginning{false, find_restart(options.restart, options.out, scene, options.resolved, comm)};
  if (!beginning.restart && old.any) {
    require_repeatable(old, options.out);
    if (comm.is_root()) fmt::print(stderr, "breccia: no checkpoint in {}: starting anew\n", options.out.string());
  }
  remove_stale_stop(options.out, comm);
  return beginning;
}

}  // namespace breccia::sim

// Runs a scene from the first particle to the summary.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "breccia/scene.hpp"
#include "grid/device.hpp"
#include "mpi/comm.hpp"

namespace breccia::sim {

/// What the command line adds to a scene.
struct RunOptions {
  std::filesystem::path out;           ///< output folder; empty: out/<scene name>
  std::optional<double> until;         ///< ends at this time instead of Scene::time.end [s]
  std::optional<std::uint64_t> steps;  ///< ends after this many steps
  std::string restart;                 ///< "auto" or a checkpoint to continue from; empty: a new run
  std::optional<double> walltime;      ///< ends with a checkpoint before this much wall time is over [s]
  std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();  ///< from when that is counted
  int threads = 1;                                                                   ///< OpenMP threads of each rank
  grid::Device device = grid::Device::kAuto;
  bool profile = false;               ///< prints the stage timers at the end
  std::filesystem::path timeline;     ///< file for what each rank did when in the last steps; empty: none
  std::vector<ResolvedKey> resolved;  ///< for summary.json
};

/// Runs `scene` on all ranks of `comm` and writes snapshots, diagnostics.csv and summary.json into the output folder.
/// Collective. Throws UsageError, IoError or NumericsError, and an Error with ExitCode::kStopped after the checkpoint
/// of a run that was told to stop; the same on every rank.
void run(const Scene& scene, const RunOptions& options, const mpi::Comm& comm);

}  // namespace breccia::sim

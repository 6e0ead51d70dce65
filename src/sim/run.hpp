// Runs a scene from the first particle to the summary.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "breccia/scene.hpp"
#include "mpi/comm.hpp"

namespace breccia::sim {

/// What the command line adds to a scene.
struct RunOptions {
  std::filesystem::path out;           ///< output folder; empty: out/<scene name>
  std::optional<double> until;         ///< ends at this time instead of Scene::time.end [s]
  std::optional<std::uint64_t> steps;  ///< ends after this many steps
  int threads = 1;                     ///< OpenMP threads of each rank
  bool profile = false;                ///< prints the stage timers at the end
  std::vector<ResolvedKey> resolved;   ///< for summary.json
};

/// Runs `scene` on all ranks of `comm` and writes snapshots, diagnostics.csv and summary.json into the output folder.
/// Collective. Throws UsageError, IoError or NumericsError, the same on every rank.
void run(const Scene& scene, const RunOptions& options, const mpi::Comm& comm);

}  // namespace breccia::sim

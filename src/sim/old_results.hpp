// Whose results a folder holds, and how far they reach.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "breccia/scene.hpp"
#include "mpi/comm.hpp"

namespace breccia::sim {

/// What earlier runs left in an output folder.
struct OldResults {
  bool any = false;      ///< a run began there
  bool ended = false;    ///< and came to its end, as its summary.json says:
  double reached = 0.0;  ///< simulated time, with half a step more [s]
  std::uint64_t steps = 0;
  std::uint64_t window = 1;  ///< steps of its gravity windows
  bool headless = false;     ///< there are snapshots, but not the first: it began at a checkpoint of another folder
};

/// Reads what `folder` holds before a run goes on there; nothing is changed. Throws IoError if the snapshots or the
/// summary are of a scene with another name, UsageError if they are of one with other `keys` (require_same_scene). A
/// summary that cannot be read is passed over with a warning, a snapshot likewise where there are checkpoints: those
/// tell by themselves what they are of. Collective; the same on all ranks.
OldResults old_results(const std::filesystem::path& folder, const Scene& scene, const std::vector<ResolvedKey>& keys,
                       const mpi::Comm& comm);

}  // namespace breccia::sim

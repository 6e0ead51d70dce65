// Whose results a folder holds.
#pragma once

#include <filesystem>
#include <vector>

#include "breccia/scene.hpp"
#include "io/summary.hpp"
#include "mpi/comm.hpp"

namespace breccia::sim {

/// Before a run goes on in `folder`: throws IoError if the snapshots or the summary there are of a scene with another
/// name, UsageError if a finished run there had other keys (require_same_scene); the same on all ranks. Collective.
void require_own_folder(const std::filesystem::path& folder, const Scene& scene, const std::vector<ResolvedKey>& keys,
                        const mpi::Comm& comm);

}  // namespace breccia::sim

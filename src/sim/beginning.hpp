// Where a run begins: at the start of its scene, at a checkpoint, or at its end already.
#pragma once

#include <optional>

#include "breccia/scene.hpp"
#include "mpi/comm.hpp"
#include "sim/checkpoints.hpp"
#include "sim/run.hpp"

namespace breccia::sim {

struct Beginning {
  bool finished = false;           ///< the folder holds this run up to its end
  std::optional<Restart> restart;  ///< none: from the start of the scene
};

/// Looks at the output folder, makes it ready and finds the checkpoint to go on from, as `options` ask; says what a
/// user could not know. `end`: of the run [s]. Collective. Throws what prepare_output_folder, old_results and
/// find_restart do, and UsageError if a run that ended there left no checkpoint and would have to be done again.
Beginning begin(const Scene& scene, const RunOptions& options, double end, const mpi::Comm& comm);

}  // namespace breccia::sim

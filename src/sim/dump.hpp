// What a run leaves behind when its numbers went wrong.
#pragma once

#include <filesystem>
#include <string>

#include "breccia/scene.hpp"
#include "mpi/comm.hpp"
#include "sim/time_loop.hpp"

namespace breccia::sim {

/// Writes dump.hdf, a snapshot of all particles as they stand (velocities v^{n-1/2}, no grid density), and dump.json
/// with the error and, where it is known, the particle before and after. Returns `error` with their place, or with the
/// reason why they could not be written. Collective; never throws.
std::string dump(const TimeLoop& loop, const Scene& scene, const std::string& error,
                 const std::filesystem::path& folder, const mpi::Comm& comm);

}  // namespace breccia::sim

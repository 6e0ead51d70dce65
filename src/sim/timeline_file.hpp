// The timeline of all ranks as a file that trace viewers open.
#pragma once

#include <filesystem>

#include "breccia/timeline.hpp"
#include "mpi/comm.hpp"

namespace breccia::sim {

/// The moment from which the timelines of all ranks count: clocks of different machines have different beginnings.
/// Collective.
Timeline::Clock::time_point common_start(const mpi::Comm& comm);

/// Writes the bars of all ranks in the Trace Event Format that Chrome, Perfetto and others read: one process for each
/// rank, with a row for stages, tiles and messages. Collective. Throws IoError, the same on all ranks.
void write_timeline(const std::filesystem::path& path, const Timeline& timeline, Timeline::Clock::time_point start,
                    const mpi::Comm& comm);

}  // namespace breccia::sim

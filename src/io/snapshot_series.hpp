// The list of a run's snapshots with their times, which ParaView and PyVista read as one time series.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "mpi/comm.hpp"

namespace breccia::io {

/// "snap_0007.hdf": at least four digits.
std::string snapshot_name(std::uint64_t number);

/// Enters snapshot `number` at `time` [s] into run.hdf.series in `folder` as the last one. A list that is gone or,
/// which a warning tells, damaged is made anew from the snapshots. The file is replaced in one go. Collective. Throws
/// IoError, the same on all ranks.
void add_to_series(const std::filesystem::path& folder, std::uint64_t number, double time, const mpi::Comm& comm);

/// Takes snapshots with this and later numbers off the list. Collective; otherwise as add_to_series.
void cut_series(const std::filesystem::path& folder, std::uint64_t first_number, const mpi::Comm& comm);

}  // namespace breccia::io

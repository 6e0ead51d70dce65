// The folder a run writes into.
#pragma once

#include <filesystem>

#include "mpi/comm.hpp"

namespace breccia::io {

/// Makes sure that `folder` exists, is empty and can be written to; creates it with its parents if need be. Only the
/// root touches the file system. Collective. Throws UsageError if it holds something already, IoError if it cannot be
/// created or written to; the same on all ranks.
void prepare_output_folder(const std::filesystem::path& folder, const mpi::Comm& comm);

/// The same for a run that goes on: the folder may hold what a run left there, which is known by its diagnostics.csv.
void continue_output_folder(const std::filesystem::path& folder, const mpi::Comm& comm);

}  // namespace breccia::io

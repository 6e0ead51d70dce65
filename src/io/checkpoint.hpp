// Checkpoints: one HDF5 file with the whole state of a run, written by all ranks together.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "breccia/engine_state.hpp"
#include "breccia/error.hpp"
#include "mpi/comm.hpp"

namespace breccia::io {

struct Checkpoint {
  EngineState engine;  ///< of this rank
  std::string run;     ///< everything else, JSON
};

/// A checkpoint of a format that this program does not read: whole, and of use to the program that wrote it.
class UnknownFormat : public IoError {
 public:
  using IoError::IoError;
};

/// "checkpoint_0007.h5"
std::string checkpoint_name(std::uint64_t number);

/// Numbers of the checkpoints in `folder`, newest first; none if there is no such folder. Collective.
std::vector<std::uint64_t> checkpoint_numbers(const std::filesystem::path& folder, const mpi::Comm& comm);

/// Removes all checkpoints of `folder` but `newest` and the keep - 1 before it; later numbers are of a run that this
/// one has gone back behind, or damaged. Collective.
void remove_other_checkpoints(const std::filesystem::path& folder, std::uint64_t newest, std::uint64_t keep,
                              const mpi::Comm& comm);

/// Writes `path`, flushed to storage and with its checksum, in full or not at all; of `run` the root's counts.
/// Collective. Throws IoError, the same on all ranks.
void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint, const mpi::Comm& comm);

/// Reads a checkpoint in which damage_of() found nothing. On as many ranks as wrote it each gets what it had, in its
/// order; on others the particles are dealt out evenly. Collective. Throws UnknownFormat, IoError, naming the file; the
/// same on all ranks.
Checkpoint read_checkpoint(const std::filesystem::path& path, const mpi::Comm& comm);

}  // namespace breccia::io

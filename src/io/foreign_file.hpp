// Files of others. HDF5 trusts what it reads: a damaged file can crash the program that opens it.
#pragma once

#include <filesystem>
#include <functional>

#include "mpi/comm.hpp"

namespace breccia::io {

/// Reads all of the HDF5 file `path` in a child process first. Throws IoError if that crashes or does not come to an
/// end. What is merely not as expected is left to the reader. Needs no MPI.
void require_harmless(const std::filesystem::path& path);

/// The same by a child of the root, with the same outcome on all ranks. Collective.
void require_harmless(const std::filesystem::path& path, const mpi::Comm& comm);

/// The same with another reader in the child, which gets `seconds` for it.
void require_harmless(const std::filesystem::path& path, const mpi::Comm& comm,
                      const std::function<void(const std::filesystem::path&)>& reader, unsigned seconds);

}  // namespace breccia::io

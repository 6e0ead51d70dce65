// A checksum at the end of a file, behind what its own format reads: damage is seen before the format's library opens
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "mpi/comm.hpp"

namespace breccia::io {

/// Appends length and CRC-32 (zlib) of the finished file. All ranks read a share. Collective. Throws IoError.
void append_checksum(const std::filesystem::path& path, const mpi::Comm& comm);

/// What is wrong with a file that append_checksum() closed: "truncated or ...", "its checksum is wrong"; empty if
/// nothing is. The same on all ranks. Collective.
std::string damage_of(const std::filesystem::path& path, const mpi::Comm& comm);

/// CRC-32 of the bytes of all ranks, those of rank 0 first; it does not depend on how they are shared out. Collective.
std::uint64_t checksum_over_ranks(std::span<const std::byte> mine, const mpi::Comm& comm);

}  // namespace breccia::io

// HDF5 files that are either there in full or not at all, written by all ranks together.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "io/hdf5.hpp"
#include "mpi/comm.hpp"

namespace breccia::io {

/// Writes a new `path`: `content` fills the file under a temporary name for which `bytes` are reserved, `finish` (may
/// be empty) gets that name once the file is closed, then it is flushed and renamed. After a failure `path` is as it
/// was before. Collective. Throws IoError.
void write_durably(const std::filesystem::path& path, std::uint64_t bytes, const mpi::Comm& comm,
                   const std::function<void(h5::File&)>& content,
                   const std::function<void(const std::filesystem::path&)>& finish = {});

}  // namespace breccia::io

// Files that are either there in full or not at all: written under another name, flushed to storage, renamed.
// Nothing here is collective: call it on one rank (see on_root).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace breccia::io {

/// The name a file has while it is written: in the same folder, so that renaming never copies.
std::filesystem::path temporary_name(const std::filesystem::path& path);

/// Removes a temporary file and the empty locks that MPI put beside it (NAME-JOB-PROCESS.lock), now or in a run that
/// was killed. What cannot be removed stays.
void discard_file(const std::filesystem::path& temporary);

/// Flushes the finished file `temporary` to storage and gives it the name `path`, replacing what was there.
/// Throws IoError.
void commit_file(const std::filesystem::path& temporary, const std::filesystem::path& path);

/// Writes `content` as the new `path`. After a failure `path` is as it was before. Throws IoError.
void write_file(const std::filesystem::path& path, std::string_view content);

/// Lets an existing file grow to `bytes` of allocated space, so that a full disk or quota is found before the ranks
/// write together. Where the file system cannot allocate ahead, the free space it reports is compared instead.
/// Throws IoError if the space is not there.
void reserve_space(const std::filesystem::path& path, std::uint64_t bytes);

/// Throws IoError unless a small file can be made beside `temporary`, as MPI makes one to lock it: ranks that open a
/// file together where it cannot wait for each other forever.
void require_room_for_lock(const std::filesystem::path& temporary);

}  // namespace breccia::io

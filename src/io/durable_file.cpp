#include "io/durable_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include "breccia/error.hpp"

namespace breccia::io {

namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* what) {
  throw IoError(fmt::format("{}: cannot {}: {}", path.string(), what, std::strerror(errno)));
}

/// A POSIX file descriptor, closed at the end of its scope.
class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags, const char* what) : fd_(::open(path.c_str(), flags, 0666)) {
    if (fd_ < 0) fail(path, what);
  }
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }
  /// Network file systems report a failed write only here.
  int close() { return ::close(std::exchange(fd_, -1)); }

 private:
  int fd_;
};

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : ".";
}

void write_all(int fd, std::string_view content, const std::filesystem::path& path) {
  while (!content.empty()) {
    const ssize_t written = ::write(fd, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(path, "write");
    content.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace

std::filesystem::path temporary_name(const std::filesystem::path& path) {
  std::filesystem::path temporary = path;
  temporary += ".part";
  return temporary;
}

void discard_file(const std::filesystem::path& temporary) {
  std::error_code ignored;
  std::filesystem::remove(temporary, ignored);
  const std::string locks = temporary.filename().string() + "-";
  std::filesystem::directory_iterator entry(folder_of(temporary), ignored);
  for (; entry != std::filesystem::directory_iterator(); entry.increment(ignored)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with(locks) && name.ends_with(".lock")) std::filesystem::remove(entry->path(), ignored);
  }
}

void commit_file(const std::filesystem::path& temporary, const std::filesystem::path& path) {
  Descriptor file(temporary, O_RDWR, "open");
  if (::fsync(file.get()) != 0) fail(temporary, "flush to storage");
  if (file.close() != 0) fail(temporary, "close");
  if (::rename(temporary.c_str(), path.c_str()) != 0) fail(path, "rename the finished file to this name");
  // The new name itself is data of the folder.
  const std::filesystem::path folder = folder_of(path);
  const Descriptor directory(folder, O_RDONLY | O_DIRECTORY, "open");
  if (::fsync(directory.get()) != 0 && errno != EINVAL) fail(folder, "flush to storage");
}

void write_file(const std::filesystem::path& path, std::string_view content) {
  const std::filesystem::path temporary = temporary_name(path);
  try {
    Descriptor file(temporary, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, "create");
    write_all(file.get(), content, temporary);
    if (file.close() != 0) fail(temporary, "write");
    commit_file(temporary, path);
  } catch (const IoError&) {
    ::unlink(temporary.c_str());
    throw;
  }
}

void reserve_space(const std::filesystem::path& path, std::uint64_t bytes) {
  const Descriptor file(path, O_RDWR, "open");
  int reason = 0;
  do {
    reason = ::fallocate(file.get(), 0, 0, static_cast<off_t>(bytes)) == 0 ? 0 : errno;
  } while (reason == EINTR);
  if (reason == 0) return;
  if (reason == EOPNOTSUPP) {
    std::error_code unknown;
    const std::filesystem::space_info space = std::filesystem::space(path, unknown);
    if (unknown || space.available >= bytes) return;
    reason = ENOSPC;
  }
  throw IoError(fmt::format("{}: cannot reserve the {:.4g} MB it may need: {}", path.string(),
                            static_cast<double>(bytes) / 1e6, std::strerror(reason)));
}

void require_room_for_lock(const std::filesystem::path& temporary) {
  const std::string block(4096, '\0');
  std::filesystem::path lock = temporary;
  lock += "-room.lock";
  try {
    Descriptor file(lock, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, "create");
    write_all(file.get(), block, lock);
    if (::fsync(file.get()) != 0 || file.close() != 0) fail(lock, "write");
  } catch (const IoError&) {
    ::unlink(lock.c_str());
    throw;
  }
  ::unlink(lock.c_str());
}

}  // namespace breccia::io

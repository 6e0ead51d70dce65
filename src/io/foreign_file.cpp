#include "io/foreign_file.hpp"

#include <fmt/format.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <vector>

#include "breccia/error.hpp"
#include "io/collectively.hpp"

namespace breccia::io {

namespace {

using Reader = std::function<void(const std::filesystem::path&)>;

constexpr hsize_t kBlock = hsize_t{1} << 20;  // elements that the child reads at once
// A damaged file can send HDF5 in circles. Whole ones are read at 100 MB/s and more.
constexpr unsigned kLeastSeconds = 20;
constexpr std::uintmax_t kBytesPerSecond = 20'000'000;

void read_blocks(hid_t set, hid_t space, hid_t type) {
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank < 1 || rank > 2) return;
  std::array<hsize_t, 2> size{1, 1};
  H5Sget_simple_extent_dims(space, size.data(), nullptr);
  const hsize_t width = std::max<hsize_t>(size[1], 1);
  if (width > kBlock) return;
  const hsize_t rows = kBlock / width;
  std::vector<double> values(kBlock);
  for (hsize_t first = 0; first < size[0]; first += rows) {
    const std::array<hsize_t, 2> start{first, 0};
    const std::array<hsize_t, 2> count{std::min(rows, size[0] - first), width};
    const hid_t memory = H5Screate_simple(rank, count.data(), nullptr);
    H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
    const herr_t done = H5Dread(set, type, memory, space, H5P_DEFAULT, values.data());
    H5Sclose(memory);
    if (done < 0) return;
  }
}

herr_t read_attribute(hid_t object, const char* name, const H5A_info_t*, void*) {
  const hid_t attribute = H5Aopen(object, name, H5P_DEFAULT);
  const hid_t type = H5Aget_type(attribute);
  const hsize_t size = H5Aget_storage_size(attribute);
  if (size > 0 && size < kBlock && H5Tis_variable_str(type) == 0) {
    std::vector<char> value(2 * size);
    H5Aread(attribute, type, value.data());
  }
  H5Tclose(type);
  H5Aclose(attribute);
  return 0;
}

herr_t read_object(hid_t file, const char* name, const H5O_info_t* info, void*) {
  const hid_t object = H5Oopen(file, name, H5P_DEFAULT);
  if (object < 0) return 0;
  H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, read_attribute, nullptr);
  if (info->type == H5O_TYPE_DATASET) {
    const hid_t space = H5Dget_space(object);
    const hid_t type = H5Dget_type(object);
    const H5T_class_t kind = H5Tget_class(type);
    if (kind == H5T_FLOAT) read_blocks(object, space, H5T_NATIVE_DOUBLE);
    if (kind == H5T_INTEGER) read_blocks(object, space, H5T_NATIVE_INT64);
    H5Tclose(type);
    H5Sclose(space);
  }
  H5Oclose(object);
  return 0;
}

void read_everything(const std::filesystem::path& path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file >= 0) H5Ovisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, read_object, nullptr);
}

// In the child. MPI is not touched there, no handler of the parent runs, and no exception comes out.
[[noreturn]] void child(const std::filesystem::path& path, const Reader& reader, unsigned seconds) noexcept {
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGALRM}) std::signal(signal, SIG_DFL);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  // The C library's last words about a damaged heap are of no use to anyone.
  std::fclose(stderr);
  ::close(STDERR_FILENO);
  alarm(seconds);
  reader(path);
  _exit(0);
}

int status_of_child(const std::filesystem::path& path, const Reader& reader, unsigned seconds) {
  const pid_t pid = fork();
  if (pid < 0) throw IoError(fmt::format("{}: no child process to read it: {}", path.string(), std::strerror(errno)));
  if (pid == 0) child(path, reader, seconds);
  int status = 0;
  while (waitpid(pid, &status, 0) < 0) {
    if (errno != EINTR) throw IoError(fmt::format("{}: {}", path.string(), std::strerror(errno)));
  }
  return status;
}

void require_that_it_ends_well(const std::filesystem::path& path, const Reader& reader, unsigned seconds) {
  const int status = status_of_child(path, reader, seconds);
  if (status == 0) return;
  const bool endless = WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM;
  throw IoError(fmt::format("{}: the file is damaged: reading it {}", path.string(),
                            endless ? "does not come to an end" : "crashes HDF5"));
}

}  // namespace

void require_harmless(const std::filesystem::path& path) {
  std::error_code unknown;
  const std::uintmax_t bytes = std::filesystem::file_size(path, unknown);
  if (unknown) return;  // nothing there to read
  require_that_it_ends_well(path, read_everything, kLeastSeconds + static_cast<unsigned>(bytes / kBytesPerSecond));
}

void require_harmless(const std::filesystem::path& path, const mpi::Comm& comm) {
  on_root(comm, [&] { require_harmless(path); });
}

void require_harmless(const std::filesystem::path& path, const mpi::Comm& comm, const Reader& reader,
                      unsigned seconds) {
  on_root(comm, [&] { require_that_it_ends_well(path, reader, seconds); });
}

}  // namespace breccia::io

#include "io/hdf5.hpp"

#include <fmt/format.h>

#include "io/collectively.hpp"
#include "io/durable_file.hpp"
#include "io/hdf5_checks.hpp"

namespace breccia::io::h5 {

template <>
hid_t type_of<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
hid_t type_of<std::int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
hid_t type_of<std::uint64_t>() {
  return H5T_NATIVE_UINT64;
}
template <>
hid_t type_of<std::uint32_t>() {
  return H5T_NATIVE_UINT32;
}
template <>
hid_t type_of<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}

namespace {

// Keeps HDF5 from printing its own account of an error that we report.
class QuietErrors {
 public:
  QuietErrors() {
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~QuietErrors() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

Handle parallel_access(const mpi::Comm& comm) {
  Handle access = checked(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  check(H5Pset_fapl_mpio(access.get(), comm.handle(), MPI_INFO_NULL));
  check(H5Pset_all_coll_metadata_ops(access.get(), true));
  check(H5Pset_coll_metadata_write(access.get(), true));
  return access;
}

// Every rank for itself. Through MPI a file that is only read takes a lock, a new file beside it, and where that cannot
// be written (a full disk) ranks wait for each other forever. HDF5's own lock is not needed either: no file is written
// that has its final name.
Handle access_of_a_reader() {
  Handle access = checked(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
#if H5_VERSION_GE(1, 12, 1) || (H5_VERSION_GE(1, 10, 7) && !H5_VERSION_GE(1, 11, 0))
  check(H5Pset_file_locking(access.get(), false, true));
#endif
  return access;
}

}  // namespace

CallFailed::CallFailed() {
  // Level 0 of an upward walk is where the failure happened first.
  const auto innermost = [](unsigned level, const H5E_error2_t* entry, void* text) -> herr_t {
    if (level == 0 && entry->desc != nullptr) *static_cast<std::string*>(text) = entry->desc;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, innermost, &reason_);
  if (reason_.empty()) reason_ = "HDF5 gives no reason";
}

std::string File::failure_text(const std::string& object, const char* what, const char* reason) const {
  const std::string where = object.empty() ? path_.string() : fmt::format("{}: {}", path_.string(), object);
  return fmt::format("{}: cannot {}: {}", where, what, reason);
}

void File::stage(const std::string& object, const char* what, const std::function<void()>& body) const {
  collectively(comm_, [&] {
    const QuietErrors quiet;
    try {
      body();
    } catch (const CallFailed& failure) {
      throw IoError(failure_text(object, what, failure.what()));
    }
  });
}

void File::write_or_end(const std::string& object, const char* what, const std::function<void()>& body) const {
  const QuietErrors quiet;
  try {
    body();
  } catch (const CallFailed& failure) {
    discard_file(path_);
    fmt::print(stderr, "error: {}\n", failure_text(object, what, failure.what()));
    MPI_Abort(comm_.handle(), static_cast<int>(ExitCode::kIo));
  }
}

File File::create(const std::filesystem::path& path, const mpi::Comm& comm) {
  File file(path, comm);
  file.stage("", "create", [&] {
    const Handle access = parallel_access(comm);
    file.file_ = checked(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.get()), H5Fclose);
  });
  return file;
}

File File::open(const std::filesystem::path& path, const mpi::Comm& comm) {
  File file(path, comm);
  file.stage("", "open as an HDF5 file", [&] {
    const Handle access = access_of_a_reader();
    file.file_ = checked(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose);
  });
  return file;
}

void File::close() {
  write_or_end("", "flush", [&] { check(H5Fflush(file_.get(), H5F_SCOPE_GLOBAL)); });
  write_or_end("", "close", [&] { check(file_.close()); });
}

bool File::exists(const std::string& object) const {
  bool found = true;
  stage(object, "look for", [&] {
    // HDF5 wants to be asked for every part of the path in turn.
    for (std::size_t end = object.find('/', 1); found; end = object.find('/', end + 1)) {
      const htri_t answer = H5Lexists(file_.get(), object.substr(0, end).c_str(), H5P_DEFAULT);
      check(answer);
      found = answer > 0;
      if (end == std::string::npos) break;
    }
  });
  return found;
}

std::vector<std::uint64_t> File::shape(const std::string& dataset) const {
  std::vector<std::uint64_t> extents;
  stage(dataset, "open", [&] {
    const Handle set = checked(H5Dopen2(file_.get(), dataset.c_str(), H5P_DEFAULT), H5Dclose);
    const Handle space = checked(H5Dget_space(set.get()), H5Sclose);
    const int rank = H5Sget_simple_extent_ndims(space.get());
    check(rank);
    std::vector<hsize_t> sizes(static_cast<std::size_t>(rank));
    check(H5Sget_simple_extent_dims(space.get(), sizes.data(), nullptr));
    extents.assign(sizes.begin(), sizes.end());
  });
  return extents;
}

std::size_t File::element_bytes(const std::string& dataset) const {
  std::size_t bytes = 0;
  stage(dataset, "open", [&] {
    const Handle set = checked(H5Dopen2(file_.get(), dataset.c_str(), H5P_DEFAULT), H5Dclose);
    const Handle type = checked(H5Dget_type(set.get()), H5Tclose);
    bytes = H5Tget_size(type.get());
  });
  return bytes;
}

void File::create_group(const std::string& group) {
  stage(group, "create the group",
        [&] { checked(H5Gcreate2(file_.get(), group.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose); });
}

void File::link(const std::string& object, const std::string& name) {
  stage(name, "link", [&] {
    check(H5Lcreate_hard(file_.get(), object.c_str(), file_.get(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT));
  });
}

Handle File::open_object(const std::string& object) const {
  return checked(H5Oopen(file_.get(), object.c_str(), H5P_DEFAULT), H5Oclose);
}

}  // namespace breccia::io::h5

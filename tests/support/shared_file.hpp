// A file all ranks see, in the folder of rank 0; removed with the object. Collective.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "mpi/comm.hpp"

namespace breccia::test {

class SharedFile {
 public:
  SharedFile(const std::string& name, const mpi::Comm& comm) : comm_(comm) {
    const auto pid = comm.allgather(static_cast<std::int64_t>(getpid()))[0];
    path_ = std::filesystem::temp_directory_path() / ("breccia_" + name + "_" + std::to_string(pid) + ".h5");
  }
  ~SharedFile() {
    comm_.barrier();
    if (comm_.is_root()) std::filesystem::remove_all(path_);
  }
  SharedFile(const SharedFile&) = delete;
  SharedFile& operator=(const SharedFile&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  mpi::Comm comm_;
  std::filesystem::path path_;
};

}  // namespace breccia::test

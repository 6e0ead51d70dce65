// Files of others: what crashes the child that reads them first is an error, what is merely wrong is left to the reader.
#include "io/foreign_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

#include "breccia/error.hpp"
#include "io/snapshot.hpp"
#include "particles_for_test.hpp"

namespace breccia::io {
namespace {

namespace fs = std::filesystem;

// Without the 8 MB for its buffer the child ends by SIGABRT: as good as a crash in HDF5, and the same everywhere.
class NoMoreMemory {
 public:
  NoMoreMemory() {
    getrlimit(RLIMIT_AS, &old_);
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlimit limit{pages * static_cast<rlim_t>(getpagesize()) + (rlim_t{2} << 20), old_.rlim_max};
    setrlimit(RLIMIT_AS, &limit);
  }
  ~NoMoreMemory() { setrlimit(RLIMIT_AS, &old_); }
  NoMoreMemory(const NoMoreMemory&) = delete;
  NoMoreMemory& operator=(const NoMoreMemory&) = delete;

 private:
  rlimit old_{};
};

TEST(ForeignFile, WholeAndMerelyWrongOnesPass) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("foreign", comm);
  const fs::path path = folder.path() / "snap.hdf";
  write_snapshot(path, {}, test::scattered_particles(2000, comm), {}, comm);
  EXPECT_NO_THROW(require_harmless(path, comm));
  EXPECT_NO_THROW(require_harmless(folder.path() / "absent.hdf", comm));
  if (comm.is_root()) std::ofstream(folder.path() / "text") << "no HDF5";
  comm.barrier();
  EXPECT_NO_THROW(require_harmless(folder.path() / "text", comm));
}

TEST(ForeignFile, CrashOfTheChildIsAnErrorOnAllRanks) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("crashing", comm);
  const fs::path path = folder.path() / "snap.hdf";
  write_snapshot(path, {}, test::scattered_particles(2000, comm), {}, comm);
  std::string error;
  {
    const NoMoreMemory limit;
    try {
      require_harmless(path, comm);
    } catch (const IoError& e) {
      error = e.what();
    }
  }
  EXPECT_NE(error.find("snap.hdf: the file is damaged: reading it crashes HDF5"), std::string::npos) << error;
}

}  // namespace
}  // namespace breccia::io

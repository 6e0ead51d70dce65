// Files of others: what crashes the child that reads them first is an error, what is merely wrong is left to the
// reader.
#include "io/foreign_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <new>
#include <string>

#include "breccia/error.hpp"
#include "io/snapshot.hpp"
#include "particles_for_test.hpp"

namespace breccia::io {
namespace {

namespace fs = std::filesystem;

// The error of a reader, the same on all ranks.
std::string error_with(const std::function<void(const fs::path&)>& reader, const mpi::Comm& comm) {
  try {
    require_harmless("some.hdf", comm, reader, 1);
  } catch (const IoError& error) {
    return error.what();
  }
  return {};
}

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
  const std::string crashes = "some.hdf: the file is damaged: reading it crashes HDF5";
  EXPECT_EQ(error_with([](const fs::path&) {}, comm), "");
  EXPECT_EQ(error_with([](const fs::path&) { std::raise(SIGSEGV); }, comm), crashes);
  EXPECT_EQ(error_with([](const fs::path&) { std::abort(); }, comm), crashes);
  EXPECT_EQ(error_with([](const fs::path&) { throw std::bad_alloc(); }, comm), crashes);
  EXPECT_EQ(error_with([](const fs::path&) { ::pause(); }, comm),
            "some.hdf: the file is damaged: reading it does not come to an end");
}

}  // namespace
}  // namespace breccia::io

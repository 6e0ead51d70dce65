// Files of others: what crashes the child that reads them first is an error, what is merely wrong is left to the
// reader.
#include "io/foreign_file.hpp"

#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <new>
#include <string>
#include <vector>

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

// A file of 40 x 3 integers in chunks of 8 rows.
void write_integers(const fs::path& path) {
  const std::array<hsize_t, 2> size{40, 3}, chunk{8, 3};
  const std::vector<int> values(120, 2);
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t space = H5Screate_simple(2, size.data(), nullptr);
  const hid_t layout = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(layout, 2, chunk.data());
  const hid_t set = H5Dcreate2(file, "numbers", H5T_STD_I32LE, space, H5P_DEFAULT, layout, H5P_DEFAULT);
  H5Dwrite(set, H5T_NATIVE_INT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  H5Dclose(set);
  H5Pclose(layout);
  H5Sclose(space);
  H5Fclose(file);
}

// One bit of the file turns its integers of 4 bytes into ones of 32,772, and HDF5 1.10.8 reads beyond the chunk. Found
// by reading damaged copies; a later HDF5 may refuse the file, which then is merely wrong.
TEST(ForeignFile, CrashOfHdf5ItselfIsAnError) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("foreign_crash", comm);
  const fs::path path = folder.path() / "integers.hdf";
  if (comm.is_root()) {
    write_integers(path);
    std::ifstream file(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), {}};
    // Datatype message: class 0 version 1, signed, 4 bytes, no offset, 32 bits.
    const std::string integer("\x10\x08\0\0\x04\0\0\0\0\0\x20\0", 12);
    const std::size_t at = bytes.find(integer);
    EXPECT_NE(at, std::string::npos);
    EXPECT_EQ(bytes.find(integer, at + 1), std::string::npos);
    bytes.at(at + 5) = '\x80';
    std::ofstream(path, std::ios::binary) << bytes;
  }
  comm.barrier();
  unsigned major = 0, minor = 0, release = 0;
  H5get_libversion(&major, &minor, &release);
  std::string error;
  try {
    require_harmless(path, comm);
  } catch (const IoError& caught) {
    error = caught.what();
  }
  const bool mended = error.empty() && (major > 1 || minor > 10 || release > 8);
  EXPECT_EQ(error, mended ? "" : path.string() + ": the file is damaged: reading it crashes HDF5");
}

}  // namespace
}  // namespace breccia::io

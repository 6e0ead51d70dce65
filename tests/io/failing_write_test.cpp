// What a run sees when the disk lets it down: the same IoError on every rank, no rank left waiting, no half file.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <semaphore.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <functional>

#include "breccia/error.hpp"
#include "io/diagnostics.hpp"
#include "io/output_folder.hpp"
#include "io/snapshot.hpp"
#include "io/snapshot_series.hpp"
#include "io/summary.hpp"
#include "particles_for_test.hpp"

namespace breccia::io {
namespace {

namespace fs = std::filesystem;

// A limit on the size of files stands for a full disk: writes beyond it fail half-way.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &old_);
    const rlimit limit{bytes, old_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit old_{};
  void (*handler_)(int);
};

template <class Call>
Error error_of(Call&& call) {
  try {
    call();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error was thrown";
  return {ExitCode::kDone, ""};
}

void expect_same_error_everywhere(const Error& error, ExitCode code, const std::string& part, const mpi::Comm& comm) {
  EXPECT_EQ(error.code(), code);
  EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  const std::size_t hash = std::hash<std::string>()(error.what());
  for (const std::size_t other : comm.allgather(hash)) EXPECT_EQ(other, hash);
}

TEST(FailingWrite, SnapshotOnAFullDisk) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("disk_full", comm);
  const ParticleOutput particles = test::scattered_particles(5000, comm);
  const FileSizeLimit limit(100000);
  const Error error = error_of([&] { write_snapshot(folder.path() / "snap_0000.hdf", {}, particles, {}, comm); });
  expect_same_error_everywhere(error, ExitCode::kIo, "snap_0000.hdf", comm);
  comm.barrier();
  EXPECT_TRUE(test::names_in(folder.path()).empty());
}

TEST(FailingWrite, AnOlderSnapshotOfThatNameStays) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("disk_full_second", comm);
  const ParticleOutput particles = test::scattered_particles(5000, comm);
  SnapshotHeader header;
  header.time = 7.0;
  write_snapshot(folder.path() / "snap_0000.hdf", header, particles, {}, comm);
  {
    const FileSizeLimit limit(100000);
    error_of([&] { write_snapshot(folder.path() / "snap_0000.hdf", {}, particles, {}, comm); });
  }
  EXPECT_EQ(read_snapshot(folder.path() / "snap_0000.hdf", comm).header.time, 7.0);
}

// A file takes the place of a folder: fails for every user, root included.
TEST(FailingWrite, FolderThatCannotBe) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("no_folder", comm);
  if (comm.is_root()) std::ofstream(folder.path() / "file") << "in the way";
  comm.barrier();
  const fs::path out = folder.path() / "file" / "out";
  const ParticleOutput particles = test::scattered_particles(10, comm);
  const std::vector<std::pair<std::string, std::function<void()>>> calls{
      {out.string(), [&] { prepare_output_folder(out, comm); }},
      {"snap_0000.hdf", [&] { write_snapshot(out / "snap_0000.hdf", {}, particles, {}, comm); }},
      {"run.hdf.series", [&] { add_to_series(out, 0, 0.0, comm); }},
      {"diagnostics.csv", [&] { const DiagnosticsWriter writer(out / "diagnostics.csv", comm); }},
      {"summary.json", [&] { write_summary(out / "summary.json", {}, comm); }},
  };
  for (const auto& [part, call] : calls) expect_same_error_everywhere(error_of(call), ExitCode::kIo, part, comm);
}

TEST(FailingWrite, DiagnosticsOnAFullDisk) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("full_device", comm);
  const fs::path path = folder.path() / "diagnostics.csv";
  if (comm.is_root()) fs::create_symlink("/dev/full", path);
  comm.barrier();
  const Error error = error_of([&] { const DiagnosticsWriter writer(path, comm); });
  expect_same_error_everywhere(error, ExitCode::kIo, "diagnostics.csv: cannot write: No space left", comm);
}

// What a process leaves that was killed while Open MPI opened a file of the same name: a semaphore that is taken, or a
// lock of a file.
TEST(FailingWrite, LeftoversOfAKilledProcessDoNotStopTheNext) {
  constexpr const char* kSemaphore = "/OMPIO_after_kill.hdf.part";
  constexpr unsigned kFarTooLong = 30;  // [s] 10 particles take a hundredth of a second
  const mpi::Comm comm;
  const test::ScratchFolder folder("after_kill", comm);
  if (comm.is_root()) {
    ASSERT_NE(sem_open(kSemaphore, O_CREAT, 0644, 0), SEM_FAILED);
    std::ofstream(folder.path() / "after_kill.hdf.part-1234-56.lock");
  }
  comm.barrier();
  alarm(kFarTooLong);
  write_snapshot(folder.path() / "after_kill.hdf", {}, test::scattered_particles(10, comm), {}, comm);
  alarm(0);
  comm.barrier();
  if (comm.is_root()) sem_unlink(kSemaphore);
  EXPECT_EQ(test::names_in(folder.path()), std::vector<std::string>{"after_kill.hdf"});
}

TEST(FailingWrite, FolderWithContentIsRefused) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("not_empty", comm);
  prepare_output_folder(folder.path() / "a" / "new", comm);
  EXPECT_TRUE(fs::is_directory(folder.path() / "a" / "new"));
  prepare_output_folder(folder.path() / "a" / "new", comm);
  const Error error = error_of([&] { prepare_output_folder(folder.path(), comm); });
  expect_same_error_everywhere(error, ExitCode::kUsage, folder.path().string(), comm);
  EXPECT_NE(std::string(error.what()).find("--out"), std::string::npos);
}

}  // namespace
}  // namespace breccia::io

// Checkpoint files up to where HDF5 opens them: the checksum finds every damage. The input is a file; with its checksum
// made right it must be found whole, and damaged again once one of its bits is turned.
#include "io/checkpoint.hpp"

#include <unistd.h>
#include <zlib.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "io/checksum.hpp"
#include "tests/fuzz/target.hpp"

namespace {

std::filesystem::path folder() {
  const std::filesystem::path base = std::filesystem::exists("/dev/shm") ? "/dev/shm" : "/tmp";
  const std::filesystem::path path = base / ("breccia_fuzz_" + std::to_string(::getpid()));
  std::filesystem::create_directories(path);
  return path;
}

void write(const std::filesystem::path& path, const std::vector<char>& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace breccia;
  fuzz::start_mpi();
  static const mpi::Comm comm;
  static const std::filesystem::path path = folder() / io::checkpoint_name(7);
  std::vector<char> bytes(data, data + size);
  write(path, bytes);
  // Chance alone does not make the checksum right.
  const bool whole = io::damage_of(path, comm).empty();
  fuzz::expect_user_errors([&] { io::checkpoint_numbers(path.parent_path(), comm); });
  if (size == 0) return 0;

  io::append_checksum(path, comm);
  if (!io::damage_of(path, comm).empty()) std::abort();
  std::ifstream file(path, std::ios::binary);
  std::vector<char> sealed((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::size_t turned = bytes.size() * 31 % sealed.size();
  sealed[turned] = static_cast<char>(sealed[turned] ^ 1 << (data[0] % 8));
  write(path, sealed);
  // Unless the input was a sealed file itself, of which the trailer was cut.
  if (!whole && io::damage_of(path, comm).empty()) std::abort();
  return 0;
}

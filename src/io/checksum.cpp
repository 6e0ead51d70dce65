#include "io/checksum.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <vector>

#include "breccia/error.hpp"
#include "io/collectively.hpp"

namespace breccia::io {

namespace {

// The last bytes of the file, as the machine holds them: checkpoints are continued where they were written.
struct Trailer {
  std::array<char, 8> magic{'B', 'R', 'E', 'C', 'C', 'R', 'C', '1'};
  std::uint64_t length = 0;  // of what is before
  std::uint64_t crc = 0;
};

struct Part {
  std::uint64_t crc = 0;
  std::uint64_t length = 0;
};

Part part_of(const std::filesystem::path& path, std::uint64_t first, std::uint64_t length) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(first));
  std::vector<char> buffer(std::size_t{1} << 20);
  uLong crc = crc32(0, nullptr, 0);
  for (std::uint64_t left = length; left > 0;) {
    const std::uint64_t wanted = std::min<std::uint64_t>(left, buffer.size());
    if (!file.read(buffer.data(), static_cast<std::streamsize>(wanted))) {
      throw IoError(fmt::format("{}: cannot read", path.string()));
    }
    crc = crc32(crc, reinterpret_cast<const Bytef*>(buffer.data()), static_cast<uInt>(wanted));
    left -= wanted;
  }
  return {crc, length};
}

std::uint64_t combined(const Part& mine, const mpi::Comm& comm) {
  uLong crc = crc32(0, nullptr, 0);
  for (const Part& part : comm.allgather(mine)) {
    crc = crc32_combine(crc, static_cast<uLong>(part.crc), static_cast<z_off_t>(part.length));
  }
  return crc;
}

// CRC-32 of the first `length` bytes, each rank reading a part.
std::uint64_t crc_of(const std::filesystem::path& path, std::uint64_t length, const mpi::Comm& comm) {
  const auto ranks = static_cast<std::uint64_t>(comm.size());
  const auto rank = static_cast<std::uint64_t>(comm.rank());
  const std::uint64_t share = length / ranks;
  Part mine;
  collectively(comm, [&] { mine = part_of(path, rank * share, rank + 1 == ranks ? length - rank * share : share); });
  return combined(mine, comm);
}

// The root's size of the file, on all ranks.
std::uint64_t size_of(const std::filesystem::path& path, const mpi::Comm& comm) {
  std::uint64_t size = 0;
  on_root(comm, [&] {
    std::error_code error;
    size = std::filesystem::file_size(path, error);
    if (error) throw IoError(fmt::format("{}: {}", path.string(), error.message()));
  });
  return comm.max(size);
}

}  // namespace

std::uint64_t checksum_over_ranks(std::span<const std::byte> mine, const mpi::Comm& comm) {
  const uLong crc = crc32_z(crc32(0, nullptr, 0), reinterpret_cast<const Bytef*>(mine.data()), mine.size());
  return combined({mine.empty() ? crc32(0, nullptr, 0) : crc, mine.size()}, comm);
}

void append_checksum(const std::filesystem::path& path, const mpi::Comm& comm) {
  Trailer trailer;
  trailer.length = size_of(path, comm);
  trailer.crc = crc_of(path, trailer.length, comm);
  on_root(comm, [&] {
    std::ofstream file(path, std::ios::binary | std::ios::app);
    file.write(reinterpret_cast<const char*>(&trailer), sizeof trailer);
    file.close();
    if (!file) throw IoError(fmt::format("{}: cannot write its checksum: {}", path.string(), std::strerror(errno)));
  });
}

std::string damage_of(const std::filesystem::path& path, const mpi::Comm& comm) {
  try {
    const std::uint64_t size = size_of(path, comm);
    if (size <= sizeof(Trailer)) return "it is truncated";
    std::array<char, sizeof(Trailer)> bytes{};
    on_root(comm, [&] {
      std::ifstream file(path, std::ios::binary);
      file.seekg(static_cast<std::streamoff>(size - sizeof(Trailer)));
      if (!file.read(bytes.data(), bytes.size())) throw IoError("it cannot be read");
    });
    std::vector<std::byte> message(sizeof(Trailer));
    std::memcpy(message.data(), bytes.data(), sizeof(Trailer));
    comm.broadcast(message);
    Trailer trailer;
    std::memcpy(&trailer, message.data(), sizeof(Trailer));
    if (trailer.magic != Trailer{}.magic) return "it is truncated or no checkpoint";
    if (trailer.length != size - sizeof(Trailer)) return "its length is wrong";
    if (trailer.crc != crc_of(path, trailer.length, comm)) return "its checksum is wrong";
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace breccia::io

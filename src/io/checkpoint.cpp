#include "io/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <functional>
#include <numeric>
#include <span>
#include <string_view>

#include "breccia/error.hpp"
#include "io/by_id.hpp"
#include "io/checksum.hpp"
#include "io/collectively.hpp"
#include "io/durable_hdf5.hpp"
#include "io/hdf5.hpp"

namespace breccia::io {

namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kFormat = 3;
// The same but for its cuts, which count planes of blocks.
constexpr std::int64_t kFormatOfBlockCuts = 2;
constexpr std::string_view kPrefix = "checkpoint_";
constexpr std::string_view kSuffix = ".h5";

// Numbers are stored by their bits: what comes back is what was there.
template <class T>
std::span<const T> bits(const StateColumn& column) {
  return {reinterpret_cast<const T*>(column.values.data()), column.values.size() / sizeof(T)};
}
std::span<const std::uint32_t> bits(const auto& values) {
  return {reinterpret_cast<const std::uint32_t*>(values.data()), values.size()};
}

template <class T>
void take_bits(StateColumn& column, const std::vector<T>& values) {
  column.element_bytes = sizeof(T);
  const auto bytes = std::as_bytes(std::span<const T>(values));
  column.values.assign(bytes.begin(), bytes.end());
}

std::uint64_t bytes_needed(const EngineState& state, const std::string& run, const mpi::Comm& comm) {
  constexpr std::uint64_t kTables = std::uint64_t{1} << 20;
  std::uint64_t bytes = 4 * state.node.size();
  for (const StateColumn& column : state.columns) bytes += column.values.size();
  return comm.sum(bytes) + run.size() + kTables;
}

// Of the values as the engine had them: tells what came wrong onto the disk, and of which field, where the checksum of
// the file only knows what became of it there.
constexpr const char* kChecksum = "Checksum";

void write_checksum(h5::File& file, const std::string& dataset, std::span<const std::byte> mine,
                    const mpi::Comm& comm) {
  file.write_attribute(dataset, kChecksum, static_cast<std::int64_t>(checksum_over_ranks(mine, comm)));
}

void require_checksum(const h5::File& file, const std::string& dataset, std::span<const std::byte> mine,
                      const mpi::Comm& comm) {
  std::int64_t written = -1;
  file.read_attribute(dataset, kChecksum, written);
  if (written != static_cast<std::int64_t>(checksum_over_ranks(mine, comm))) {
    throw IoError(dataset + ": its checksum is wrong");
  }
}

void write_column(h5::File& file, const StateColumn& column, std::uint64_t total, h5::Rows rows,
                  const mpi::Comm& comm) {
  const std::string dataset = "/Particles/" + column.name;
  const h5::Layout layout{total, column.components, 0};
  if (column.element_bytes == 4) {
    file.write_rows(dataset, layout, rows, bits<std::uint32_t>(column));
  } else {
    file.write_rows(dataset, layout, rows, bits<std::uint64_t>(column));
  }
  file.write_attribute(dataset, "Units", column.unit);
  file.write_attribute(dataset, "Description", column.meaning);
  write_checksum(file, dataset, column.values, comm);
}

std::string text_of_root(const std::string& text, const mpi::Comm& comm) {
  const auto bytes = std::as_bytes(std::span(text));
  std::vector<std::byte> message(bytes.begin(), bytes.end());
  comm.broadcast(message);
  return {reinterpret_cast<const char*>(message.data()), message.size()};
}

// The bytes of a text that all ranks hold, once.
std::span<const std::byte> of_root(const std::string& text, const mpi::Comm& comm) {
  return comm.is_root() ? std::as_bytes(std::span(text)) : std::span<const std::byte>();
}

void write_content(h5::File& file, const Checkpoint& checkpoint, const mpi::Comm& comm) {
  const EngineState& state = checkpoint.engine;
  const std::uint64_t total = comm.sum(state.particles);
  const h5::Rows rows{comm.exclusive_scan(state.particles), state.particles};
  file.create_group("/Particles");
  std::vector<std::string> names;
  for (const StateColumn& column : state.columns) names.push_back(column.name);
  file.write_attribute("/Particles", "Fields", names);
  for (const StateColumn& column : state.columns) write_column(file, column, total, rows, comm);
  file.write_rows("/Particles/node", {total, 3, 0}, rows, bits(state.node));
  write_checksum(file, "/Particles/node", std::as_bytes(std::span(state.node)), comm);

  file.create_group("/Engine");
  file.write_attribute("/Engine", "Format", kFormat);
  file.write_attribute("/Engine", "DamageFinished", std::int64_t{state.damage_finished});
  file.write_attribute("/Engine", "SmallestMass", state.smallest_mass);
  file.write_attribute("/Engine", "SlabAxis", std::int64_t{state.slab_axis});
  const auto ranks = static_cast<std::uint64_t>(comm.size());
  file.write_rows<std::uint64_t>("/Engine/ParticlesOfRank", {ranks, 1, 0}, {static_cast<std::uint64_t>(comm.rank()), 1},
                                 std::array{state.particles});
  const std::uint64_t cuts = state.slab_cuts.size();
  file.write_rows("/Engine/SlabCuts", {cuts, 1, 0}, {0, comm.is_root() ? cuts : 0}, bits(state.slab_cuts));
  // Another length on another rank would be another file to HDF5.
  const std::string run = text_of_root(checkpoint.run, comm);
  file.write_text("/Run", run);
  write_checksum(file, "/Run", of_root(run, comm), comm);
}

// The rows of this rank: what it had, or an even share.
h5::Rows rows_of(const std::vector<std::uint64_t>& of_rank, const mpi::Comm& comm) {
  const auto rank = comm.rank();
  if (of_rank.size() == static_cast<std::size_t>(comm.size())) {
    return {std::accumulate(of_rank.begin(), of_rank.begin() + rank, std::uint64_t{0}),
            of_rank[static_cast<std::size_t>(rank)]};
  }
  return share_of(rank, comm.size(), std::accumulate(of_rank.begin(), of_rank.end(), std::uint64_t{0}), 1);
}

template <class T>
std::vector<T> read_bits(const h5::File& file, const std::string& dataset, h5::Rows rows, std::uint64_t components) {
  const auto raw = file.read_rows<std::uint32_t>(dataset, rows, components);
  std::vector<T> values(raw.size());
  static_assert(sizeof(T) == sizeof(std::uint32_t));
  if (!raw.empty()) std::memcpy(values.data(), raw.data(), raw.size() * sizeof(T));
  return values;
}

// A dataset whose shape is not that of the file's particles would be read as something else.
std::uint64_t components_of(const h5::File& file, const std::string& dataset, std::uint64_t total) {
  const std::vector<std::uint64_t> shape = file.shape(dataset);
  if (shape.empty() || shape.size() > 2 || shape[0] != total) throw IoError(dataset + ": unexpected shape");
  return shape.size() == 2 ? shape[1] : 1;
}

StateColumn read_column(const h5::File& file, const std::string& name, std::uint64_t total, h5::Rows rows) {
  const std::string dataset = "/Particles/" + name;
  StateColumn column;
  column.name = name;
  column.components = components_of(file, dataset, total);
  if (file.element_bytes(dataset) == 4) {
    take_bits(column, file.read_rows<std::uint32_t>(dataset, rows, column.components));
  } else {
    take_bits(column, file.read_rows<std::uint64_t>(dataset, rows, column.components));
  }
  return column;
}

std::int64_t known_format(const h5::File& file, const fs::path& path) {
  std::int64_t format = 0;
  if (!file.read_attribute("/Engine", "Format", format)) throw IoError("no attribute Format of /Engine");
  if (format == kFormat || format == kFormatOfBlockCuts) return format;
  throw UnknownFormat(
      fmt::format("{}: format {}, but this program reads {} and {}: to be continued by the program that wrote it",
                  path.string(), format, kFormatOfBlockCuts, kFormat));
}

void read_engine(const h5::File& file, std::int64_t format, EngineState& state, const mpi::Comm& comm) {
  const std::uint64_t ranks = file.shape("/Engine/ParticlesOfRank").at(0);
  const auto of_rank = file.read_rows<std::uint64_t>("/Engine/ParticlesOfRank", {0, ranks});
  const std::uint64_t total = std::accumulate(of_rank.begin(), of_rank.end(), std::uint64_t{0});
  const h5::Rows rows = rows_of(of_rank, comm);
  state.same_ranks = format == kFormat && ranks == static_cast<std::uint64_t>(comm.size());
  state.particles = rows.count;
  for (const std::string& name : file.read_attribute_texts("/Particles", "Fields")) {
    state.columns.push_back(read_column(file, name, total, rows));
    require_checksum(file, "/Particles/" + name, state.columns.back().values, comm);
  }
  if (components_of(file, "/Particles/node", total) != 3) throw IoError("/Particles/node: unexpected shape");
  state.node = read_bits<std::int32_t>(file, "/Particles/node", rows, 3);
  require_checksum(file, "/Particles/node", std::as_bytes(std::span(state.node)), comm);
  std::int64_t damage_finished = 0;
  std::int64_t axis = 0;
  file.read_attribute("/Engine", "DamageFinished", damage_finished);
  file.read_attribute("/Engine", "SmallestMass", state.smallest_mass);
  file.read_attribute("/Engine", "SlabAxis", axis);
  state.damage_finished = damage_finished != 0;
  state.slab_axis = static_cast<int>(axis);
  state.slab_cuts = read_bits<std::int32_t>(file, "/Engine/SlabCuts", {0, file.shape("/Engine/SlabCuts")[0]}, 1);
}

}  // namespace

std::string checkpoint_name(std::uint64_t number) { return fmt::format("{}{:04}{}", kPrefix, number, kSuffix); }

std::vector<std::uint64_t> checkpoint_numbers(const fs::path& folder, const mpi::Comm& comm) {
  std::vector<std::uint64_t> numbers;
  on_root(comm, [&] {
    if (!fs::exists(folder)) return;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (name.size() <= kPrefix.size() + kSuffix.size() || !name.starts_with(kPrefix)) continue;
      std::uint64_t number = 0;
      const char* const begin = name.data() + kPrefix.size();
      const auto [end, error] = std::from_chars(begin, name.data() + name.size(), number);
      if (error == std::errc() && name == checkpoint_name(number)) numbers.push_back(number);
    }
    std::ranges::sort(numbers, std::greater<>());
  });
  return comm.allgather_arrays(std::span<const std::uint64_t>(numbers));
}

void remove_other_checkpoints(const fs::path& folder, std::uint64_t newest, std::uint64_t keep, const mpi::Comm& comm) {
  const std::vector<std::uint64_t> numbers = checkpoint_numbers(folder, comm);
  on_root(comm, [&] {
    std::uint64_t kept = 0;
    for (const std::uint64_t number : numbers) {
      if (number > newest || kept == keep) {
        // One that cannot be removed takes space, but is no reason to end a run.
        std::error_code error;
        fs::remove(folder / checkpoint_name(number), error);
        if (error)
          fmt::print(stderr, "breccia: warning: {}: cannot be removed: {}\n",
                     (folder / checkpoint_name(number)).string(), error.message());
      } else {
        ++kept;
      }
    }
  });
}

void write_checkpoint(const fs::path& path, const Checkpoint& checkpoint, const mpi::Comm& comm) {
  write_durably(
      path, bytes_needed(checkpoint.engine, checkpoint.run, comm), comm,
      [&](h5::File& file) { write_content(file, checkpoint, comm); },
      [&](const fs::path& temporary) { append_checksum(temporary, comm); });
}

Checkpoint read_checkpoint(const fs::path& path, const mpi::Comm& comm) {
  Checkpoint checkpoint;
  const h5::File file = h5::File::open(path, comm);
  try {
    read_engine(file, known_format(file, path), checkpoint.engine, comm);
    checkpoint.run = file.read_text("/Run");
    require_checksum(file, "/Run", of_root(checkpoint.run, comm), comm);
  } catch (const UnknownFormat&) {
    throw;
  } catch (const IoError& error) {
    const std::string what = error.what();
    throw IoError(what.starts_with(path.string()) ? what : fmt::format("{}: {}", path.string(), what));
  }
  return checkpoint;
}

}  // namespace breccia::io

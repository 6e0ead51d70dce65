#include <fmt/format.h>

#include <cstdio>
#include <cstring>
#include <numeric>

#include "breccia/error.hpp"
#include "io/by_id.hpp"
#include "io/collectively.hpp"
#include "io/fields.hpp"
#include "io/foreign_file.hpp"
#include "io/hdf5.hpp"
#include "io/snapshot.hpp"

namespace breccia::io {

namespace {

std::string dataset_of(const Field& field) { return std::string("/PartType0/") + field.name; }

// Says what is wrong with the file in plain words where HDF5 would only say that it cannot open it.
void require_hdf5(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) throw IoError(fmt::format("{}: no such file", path.string()));
  if (!std::filesystem::is_regular_file(path)) throw IoError(fmt::format("{}: not a file", path.string()));
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) throw IoError(fmt::format("{}: cannot be read", path.string()));
  char signature[8] = {};
  const std::size_t got = std::fread(signature, 1, sizeof(signature), file);
  std::fclose(file);
  if (got == sizeof(signature) && std::memcmp(signature, "\x89HDF\r\n\x1a\n", sizeof(signature)) == 0) return;
  throw IoError(fmt::format("{}: not an HDF5 file; a snapshot (snap_NNNN.hdf) is expected", path.string()));
}

SnapshotHeader read_header(const h5::File& file) {
  SnapshotHeader header;
  if (!file.exists("/Header")) return header;
  const std::string group = "/Header";
  file.read_attribute(group, "Time", header.time);
  file.read_attribute(group, "Step", header.step);
  file.read_attribute(group, "CellSize", header.cell);
  file.read_attribute(group, "TargetMass", header.target_mass);
  double period[3] = {};
  if (file.read_attribute_array<double>(group, "Period", period)) header.period = {period[0], period[1], period[2]};
  header.fields = file.read_attribute_texts(group, "Fields");
  const auto text = [&](const char* name) {
    const std::vector<std::string> texts = file.read_attribute_texts(group, name);
    return texts.empty() ? std::string() : texts.front();
  };
  header.scene_name = text("SceneName");
  header.code_version = text("CodeVersion");
  if (file.exists("/Parameters/Scene")) header.scene_keys = file.read_text("/Parameters/Scene");
  return header;
}

// N, from the shape of the coordinates.
std::uint64_t number_of_particles(const h5::File& file, const std::filesystem::path& path) {
  for (const char* dataset : {"/PartType0/Coordinates", "/PartType0/Masses"}) {
    if (file.exists(dataset)) continue;
    throw IoError(
        fmt::format("{}: no dataset {}; expected /PartType0/Coordinates (N,3) [m] and /PartType0/Masses (N) [kg]",
                    path.string(), dataset));
  }
  const std::vector<std::uint64_t> shape = file.shape("/PartType0/Coordinates");
  if (shape.size() == 2 && shape[1] == 3) return shape[0];
  throw IoError(fmt::format("{}: /PartType0/Coordinates must have the shape (N,3)", path.string()));
}

std::vector<double> assemble(std::vector<double> values, double) { return values; }
std::vector<Vec3d> assemble(const std::vector<double>& values, Vec3d) {
  std::vector<Vec3d> vectors(values.size() / 3);
  for (std::size_t i = 0; i < vectors.size(); ++i) vectors[i] = {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
  return vectors;
}
std::vector<std::uint64_t> assemble(std::vector<std::uint64_t> values, std::uint64_t) { return values; }
std::vector<std::uint32_t> assemble(std::vector<std::uint32_t> values, std::uint32_t) { return values; }

template <class T>
struct Stored {
  using type = T;
};
template <>
struct Stored<Vec3d> {
  using type = double;
};

void require_shape(const h5::File& file, const Field& field, std::uint64_t total, const std::filesystem::path& path) {
  std::vector<std::uint64_t> expected{total};
  if (components(field) == 3) expected.push_back(3);
  if (file.shape(dataset_of(field)) == expected) return;
  throw IoError(fmt::format("{}: {} must have the shape ({}{}) like the coordinates", path.string(), dataset_of(field),
                            total, components(field) == 3 ? ",3" : ""));
}

template <class T>
void read_field(const h5::File& file, const Field& field, h5::Rows rows, std::vector<T>& values) {
  const auto width = static_cast<std::uint64_t>(components(field));
  values = assemble(file.read_rows<typename Stored<T>::type>(dataset_of(field), rows, width), T{});
}

// The part of ParticleArrays that is always filled, for files that do not say.
void fill_missing(ParticleOutput& particles, h5::Rows rows) {
  const std::size_t n = rows.count;
  if (particles.id.empty()) {
    particles.id.resize(n);
    std::iota(particles.id.begin(), particles.id.end(), rows.first);
  }
  particles.velocity.resize(n);
  particles.body.resize(n);
  particles.material.resize(n);
  particles.damage.resize(n);
}

}  // namespace

SnapshotHeader read_snapshot_header(const std::filesystem::path& path) {
  const mpi::Comm self(MPI_COMM_SELF);
  require_hdf5(path);
  require_harmless(path);
  return read_header(h5::File::open(path, self));
}

Snapshot read_snapshot(const std::filesystem::path& path, const mpi::Comm& comm) {
  on_root(comm, [&] { require_hdf5(path); });
  require_harmless(path, comm);
  const h5::File file = h5::File::open(path, comm);
  Snapshot snapshot;
  snapshot.header = read_header(file);
  const std::uint64_t total = number_of_particles(file, path);
  snapshot.header.particles = total;
  const h5::Rows rows = share_of(comm.rank(), comm.size(), total, 1);
  for (const Field& field : snapshot_fields()) {
    if (!file.exists(dataset_of(field))) continue;
    require_shape(file, field, total, path);
    std::visit([&](auto member) { read_field(file, field, rows, snapshot.particles.*member); }, field.data);
  }
  fill_missing(snapshot.particles, rows);
  return snapshot;
}

}  // namespace breccia::io

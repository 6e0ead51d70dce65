#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include "breccia/error.hpp"
#include "io/by_id.hpp"
#include "io/collectively.hpp"
#include "io/durable_hdf5.hpp"
#include "io/fields.hpp"
#include "io/hdf5.hpp"
#include "io/snapshot.hpp"

namespace breccia::io {

namespace {

// About 256 chunks, so that as many ranks can compress at once, but none too small to compress well.
std::uint64_t chunk_rows_for(std::uint64_t particles) {
  return std::clamp<std::uint64_t>(std::bit_ceil(particles / 256 + 1), 1024, 65536);
}

std::string dataset_of(const Field& field) {
  const std::string name = field.name;
  return name == "Coordinates" ? "/VTKHDF/Points" : "/VTKHDF/PointData/" + name;
}

// The fields to be written: required or wanted, and present on the ranks that have particles.
std::vector<const Field*> fields_to_write(const ParticleOutput& particles, std::span<const std::string> wanted,
                                          const mpi::Comm& comm) {
  std::vector<const Field*> chosen;
  collectively(comm, [&] { require_known_fields(wanted); });
  for (const Field& field : snapshot_fields()) {
    const std::size_t values = std::visit([&](auto member) { return (particles.*member).size(); }, field.data);
    const bool present = comm.any(values > 0) || field.required;
    collectively(comm, [&] {
      if (!present || values == particles.size()) return;
      throw NumericsError(fmt::format("snapshot field {} has {} values on rank {} with {} particles", field.name,
                                      values, comm.rank(), particles.size()));
    });
    const bool asked_for = wanted.empty() || std::ranges::find(wanted, field.name) != wanted.end();
    if (present && (field.required || asked_for)) chosen.push_back(&field);
  }
  return chosen;
}

// Upper bound of the file: everything uncompressed, and the library's own tables.
std::uint64_t bytes_needed(std::uint64_t particles, const std::vector<const Field*>& fields) {
  constexpr std::uint64_t kCellBytes = 8 + 8 + 1;  // Connectivity, Offsets, Types
  constexpr std::uint64_t kTables = std::uint64_t{1} << 20;
  std::uint64_t bytes = kCellBytes;
  for (const Field* field : fields) {
    const std::uint64_t element = type_name(*field) == "uint32" ? 4 : 8;
    bytes += element * static_cast<std::uint64_t>(components(*field));
  }
  return particles * bytes + kTables;
}

// Writes what VTK needs to see one vertex cell per particle, all in one partition.
void write_cells(h5::File& file, std::uint64_t total, h5::Rows rows, std::uint64_t chunk_rows, const mpi::Comm& comm) {
  constexpr std::uint8_t kVertex = 1;  // VTK_VERTEX
  const bool last = comm.rank() == comm.size() - 1;
  // Cell i starts at point i; the end of the last cell is one more entry.
  const h5::Rows offset_rows{rows.first, rows.count + (last ? 1 : 0)};
  std::vector<std::int64_t> numbers(offset_rows.count);
  std::iota(numbers.begin(), numbers.end(), static_cast<std::int64_t>(rows.first));
  const std::vector<std::uint8_t> types(rows.count, kVertex);

  file.write_rows<std::int64_t>("/VTKHDF/Offsets", {total + 1, 1, chunk_rows}, offset_rows, numbers);
  file.write_rows<std::int64_t>("/VTKHDF/Connectivity", {total, 1, chunk_rows}, rows,
                                std::span(numbers).first(rows.count));
  file.write_rows<std::uint8_t>("/VTKHDF/Types", {total, 1, chunk_rows}, rows, types);
  const std::array count{static_cast<std::int64_t>(total)};
  const h5::Rows first_row{0, comm.is_root() ? 1U : 0U};
  for (const char* name : {"/VTKHDF/NumberOfPoints", "/VTKHDF/NumberOfCells", "/VTKHDF/NumberOfConnectivityIds"}) {
    file.write_rows<std::int64_t>(name, {1, 1, 0}, first_row, count);
  }
}

std::span<const double> components_of(const std::vector<Vec3d>& values) {
  static_assert(sizeof(Vec3d) == 3 * sizeof(double));
  return {reinterpret_cast<const double*>(values.data()), 3 * values.size()};
}
template <class T>
std::span<const T> components_of(const std::vector<T>& values) {
  return values;
}

void write_field(h5::File& file, const Field& field, const ParticleOutput& particles, const ById& by_id,
                 std::uint64_t chunk_rows) {
  const std::string dataset = dataset_of(field);
  const h5::Layout layout{by_id.total(), static_cast<std::uint64_t>(components(field)), chunk_rows};
  std::visit(
      [&](auto member) {
        const auto ordered = by_id(std::span(particles.*member));
        file.write_rows(dataset, layout, by_id.rows(), components_of(ordered));
      },
      field.data);
  file.write_attribute(dataset, "Units", std::string(field.unit));
  file.write_attribute(dataset, "Description", std::string(field.meaning));
  file.link(dataset, std::string("/PartType0/") + field.name);
}

void write_header(h5::File& file, const SnapshotHeader& header, std::uint64_t total,
                  const std::vector<const Field*>& fields) {
  const std::string group = "/Header";
  file.create_group(group);
  file.write_attribute(group, "Time", header.time);
  file.write_attribute(group, "Step", header.step);
  file.write_attribute(group, "CellSize", header.cell);
  file.write_attribute(group, "TargetMass", header.target_mass);
  const std::array period{header.period.x, header.period.y, header.period.z};
  file.write_attribute_array<double>(group, "Period", period);
  file.write_attribute(group, "NumberOfParticles", total);
  std::vector<std::string> names;
  for (const Field* field : fields) names.emplace_back(field->name);
  file.write_attribute(group, "Fields", names);
  file.write_attribute(group, "SceneName", header.scene_name);
  file.write_attribute(group, "CodeName", std::string("breccia"));
  file.write_attribute(group, "CodeVersion", std::string(BRECCIA_VERSION));
  file.create_group("/Parameters");
  if (!header.scene_keys.empty()) file.write_text("/Parameters/Scene", header.scene_keys);
}

// SI, said in words and in the way SWIFT's readers ask for it.
void write_units(h5::File& file) {
  const std::string group = "/Units";
  file.create_group(group);
  file.write_attribute(group, "System", std::string("SI"));
  file.write_attribute(group, "Unit length in cgs (U_L)", 100.0);
  file.write_attribute(group, "Unit mass in cgs (U_M)", 1000.0);
  file.write_attribute(group, "Unit time in cgs (U_t)", 1.0);
  file.write_attribute(group, "Unit current in cgs (U_I)", 1.0);
  file.write_attribute(group, "Unit temperature in cgs (U_T)", 1.0);
}

void write_file_content(h5::File& file, const SnapshotHeader& header, const ParticleOutput& particles,
                        const ById& by_id, const std::vector<const Field*>& fields, const mpi::Comm& comm) {
  const std::uint64_t chunk_rows = chunk_rows_for(by_id.total());
  file.create_group("/VTKHDF");
  // The reader of ParaView 5.11 accepts exactly this: a fixed-length ASCII string without terminator.
  file.write_attribute("/VTKHDF", "Type", std::string("UnstructuredGrid"));
  const std::array<std::int64_t, 2> version{1, 0};
  file.write_attribute_array<std::int64_t>("/VTKHDF", "Version", version);
  file.create_group("/VTKHDF/PointData");
  file.create_group("/PartType0");
  write_cells(file, by_id.total(), by_id.rows(), chunk_rows, comm);
  for (const Field* field : fields) write_field(file, *field, particles, by_id, chunk_rows);
  write_header(file, header, by_id.total(), fields);
  write_units(file);
}

}  // namespace

void write_snapshot(const std::filesystem::path& path, const SnapshotHeader& header, const ParticleOutput& particles,
                    std::span<const std::string> wanted_fields, const mpi::Comm& comm) {
  const std::vector<const Field*> fields = fields_to_write(particles, wanted_fields, comm);
  const std::uint64_t total = comm.sum<std::uint64_t>(particles.size());
  const ById by_id(particles.id, chunk_rows_for(total), comm);
  write_durably(path, bytes_needed(total, fields), comm,
                [&](h5::File& file) { write_file_content(file, header, particles, by_id, fields, comm); });
}

}  // namespace breccia::io

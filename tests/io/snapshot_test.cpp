// Snapshots: every bit comes back, files do not depend on the ranks, and the layout is what ParaView accepts.
#include "io/snapshot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>

#include "breccia/error.hpp"
#include "io/fields.hpp"
#include "io/hdf5.hpp"
#include "particles_for_test.hpp"

namespace breccia::io {
namespace {

namespace fs = std::filesystem;

SnapshotHeader some_header() {
  SnapshotHeader header;
  header.time = 1.0e5 / 3.0;
  header.step = 12345678901ULL;
  header.cell = 2500.0;
  header.target_mass = 1.41e18;
  header.period = {0.0, 5.0e4, 0.0};
  header.scene_name = "Köhler";
  header.scene_keys = "{\"scene.name\": \"Köhler\"}";
  return header;
}

// Compares the bytes of one vector: NaN or -0.0 would count too.
template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_particles_of_ids(const ParticleOutput& got) {
  ParticleOutput expected;
  for (const std::uint64_t id : got.id) test::append_particle(expected, id);
  for (const Field& field : snapshot_fields()) {
    const bool same = std::visit([&](auto member) { return same_bits(got.*member, expected.*member); }, field.data);
    EXPECT_TRUE(same) << field.name;
  }
}

class SnapshotRoundTrip : public testing::TestWithParam<std::uint64_t> {};

TEST_P(SnapshotRoundTrip, GivesEveryBitBack) {
  const std::uint64_t total = GetParam();
  const mpi::Comm comm;
  const test::ScratchFolder folder("round_trip", comm);
  const fs::path path = folder.path() / "snap_0000.hdf";
  write_snapshot(path, some_header(), test::scattered_particles(total, comm), {}, comm);
  EXPECT_EQ(test::names_in(folder.path()), std::vector<std::string>{"snap_0000.hdf"});

  const Snapshot snapshot = read_snapshot(path, comm);
  EXPECT_EQ(comm.sum<std::uint64_t>(snapshot.particles.size()), total);
  for (std::size_t i = 1; i < snapshot.particles.size(); ++i) {
    ASSERT_EQ(snapshot.particles.id[i], snapshot.particles.id[i - 1] + 1);
  }
  expect_particles_of_ids(snapshot.particles);

  const SnapshotHeader wrote = some_header();
  const SnapshotHeader& read = snapshot.header;
  EXPECT_EQ(read.time, wrote.time);
  EXPECT_EQ(read.step, wrote.step);
  EXPECT_EQ(read.cell, wrote.cell);
  EXPECT_EQ(read.target_mass, wrote.target_mass);
  EXPECT_EQ(read.period.y, wrote.period.y);
  EXPECT_EQ(read.scene_name, wrote.scene_name);
  EXPECT_EQ(read.scene_keys, wrote.scene_keys);
  EXPECT_EQ(read.code_version, BRECCIA_VERSION);
  EXPECT_EQ(read.particles, total);
  if (total > 0) {
    EXPECT_EQ(read.fields.size(), snapshot_fields().size());
  }
}

// None at all, fewer than ranks, one chunk, several chunks with a broken last one.
INSTANTIATE_TEST_SUITE_P(Counts, SnapshotRoundTrip, testing::Values(0, 1, 2, 1000, 20011));

// All bytes of a dataset, as stored.
std::vector<std::byte> raw_data(hid_t file, const std::string& name) {
  const h5::Handle set(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose);
  const h5::Handle type(H5Dget_type(set.get()), H5Tclose);
  const h5::Handle space(H5Dget_space(set.get()), H5Sclose);
  const auto points = static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get()));
  std::vector<std::byte> data(points * H5Tget_size(type.get()));
  EXPECT_GE(H5Dread(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data()), 0) << name;
  return data;
}

std::vector<std::string> dataset_names(hid_t file) {
  std::vector<std::string> names;
  const auto collect = [](hid_t, const char* name, const H5O_info_t* info, void* to) -> herr_t {
    if (info->type == H5O_TYPE_DATASET) static_cast<std::vector<std::string>*>(to)->emplace_back(name);
    return 0;
  };
  H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_INC, collect, &names, H5O_INFO_BASIC);
  return names;
}

h5::Handle open_serially(const fs::path& path) {
  h5::Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  EXPECT_TRUE(file.valid()) << path;
  return file;
}

TEST(Snapshot, DoesNotDependOnTheRanks) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("rank_count", comm);
  const std::uint64_t total = 20011;
  write_snapshot(folder.path() / "many.hdf", some_header(), test::scattered_particles(total, comm), {}, comm);
  if (!comm.is_root()) return;

  const mpi::Comm alone(MPI_COMM_SELF);
  write_snapshot(folder.path() / "one.hdf", some_header(), test::scattered_particles(total, alone), {}, alone);
  const h5::Handle many = open_serially(folder.path() / "many.hdf");
  const h5::Handle one = open_serially(folder.path() / "one.hdf");
  const std::vector<std::string> names = dataset_names(one.get());
  EXPECT_EQ(names, dataset_names(many.get()));
  // Twelve fields, three arrays of cells, three counts, the scene; links are visited once.
  EXPECT_EQ(names.size(), 19U);
  for (const std::string& name : names) {
    EXPECT_TRUE(raw_data(many.get(), name) == raw_data(one.get(), name)) << name;
  }
}

std::vector<std::int64_t> integers(hid_t file, const std::string& name) {
  const std::vector<std::byte> raw = raw_data(file, name);
  std::vector<std::int64_t> values(raw.size() / sizeof(std::int64_t));
  std::memcpy(values.data(), raw.data(), raw.size());
  return values;
}

// The rules found by trial with ParaView 5.11: other string types, other cells and other versions do not open.
TEST(Snapshot, FollowsTheRulesOfVtkHdf) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("vtkhdf", comm);
  const fs::path path = folder.path() / "snap_0000.hdf";
  const std::int64_t total = 3000;
  write_snapshot(path, some_header(), test::scattered_particles(total, comm), {}, comm);
  if (!comm.is_root()) return;
  const h5::Handle file = open_serially(path);

  const h5::Handle type(H5Aopen_by_name(file.get(), "/VTKHDF", "Type", H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const h5::Handle text(H5Aget_type(type.get()), H5Tclose);
  EXPECT_EQ(H5Tget_class(text.get()), H5T_STRING);
  EXPECT_EQ(H5Tis_variable_str(text.get()), 0);
  EXPECT_EQ(H5Tget_cset(text.get()), H5T_CSET_ASCII);
  ASSERT_EQ(H5Tget_size(text.get()), 16U);
  char value[16];
  H5Aread(type.get(), text.get(), value);
  EXPECT_EQ(std::string(value, 16), "UnstructuredGrid");

  const h5::Handle version(H5Aopen_by_name(file.get(), "/VTKHDF", "Version", H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  std::int64_t numbers[2] = {};
  H5Aread(version.get(), H5T_NATIVE_INT64, numbers);
  EXPECT_EQ(numbers[0], 1);
  EXPECT_EQ(numbers[1], 0);

  for (const char* count : {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"}) {
    EXPECT_EQ(integers(file.get(), std::string("/VTKHDF/") + count), std::vector<std::int64_t>{total}) << count;
  }
  const std::vector<std::int64_t> offsets = integers(file.get(), "/VTKHDF/Offsets");
  const std::vector<std::int64_t> connectivity = integers(file.get(), "/VTKHDF/Connectivity");
  ASSERT_EQ(offsets.size(), static_cast<std::size_t>(total + 1));
  ASSERT_EQ(connectivity.size(), static_cast<std::size_t>(total));
  for (std::int64_t i = 0; i < total; ++i) {
    ASSERT_EQ(offsets[static_cast<std::size_t>(i)], i);
    ASSERT_EQ(connectivity[static_cast<std::size_t>(i)], i);
  }
  EXPECT_EQ(offsets.back(), total);
  for (const std::byte cell : raw_data(file.get(), "/VTKHDF/Types")) ASSERT_EQ(cell, std::byte{1});
}

haddr_t address_of(hid_t file, const std::string& name) {
  H5O_info_t info;
  EXPECT_GE(H5Oget_info_by_name2(file, name.c_str(), &info, H5O_INFO_BASIC, H5P_DEFAULT), 0) << name;
  return info.addr;
}

TEST(Snapshot, FieldsAreLinkedAndCarryUnits) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("units", comm);
  const fs::path path = folder.path() / "snap_0000.hdf";
  write_snapshot(path, some_header(), test::scattered_particles(50, comm), {}, comm);
  {
    const h5::File file = h5::File::open(path, comm);
    for (const Field& field : snapshot_fields()) {
      const std::string dataset = std::string("/PartType0/") + field.name;
      EXPECT_EQ(file.read_attribute_texts(dataset, "Units"), std::vector<std::string>{field.unit});
      EXPECT_EQ(file.read_attribute_texts(dataset, "Description"), std::vector<std::string>{field.meaning});
    }
  }
  if (!comm.is_root()) return;
  const h5::Handle raw = open_serially(path);
  EXPECT_EQ(address_of(raw.get(), "/PartType0/Coordinates"), address_of(raw.get(), "/VTKHDF/Points"));
  EXPECT_EQ(address_of(raw.get(), "/PartType0/Damage"), address_of(raw.get(), "/VTKHDF/PointData/Damage"));
}

TEST(Snapshot, HoldsWhatWasAskedForAndWhatTheAnalysisNeeds) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("wanted", comm);
  const fs::path path = folder.path() / "snap_0000.hdf";
  ParticleOutput particles = test::scattered_particles(500, comm);
  particles.internal_energy.clear();  // the effect energy is off
  const std::vector<std::string> wanted{"Damage", "InternalEnergy"};
  write_snapshot(path, some_header(), particles, wanted, comm);
  const Snapshot snapshot = read_snapshot(path, comm);
  const std::vector<std::string> expected{"Coordinates", "Velocities", "Masses", "ParticleIDs", "Damage"};
  EXPECT_EQ(snapshot.header.fields, expected);
  EXPECT_TRUE(snapshot.particles.pressure.empty());
}

template <class Expected, class Call>
void expect_error(Call&& call, const std::string& part) {
  try {
    call();
    ADD_FAILURE() << "no error was thrown";
  } catch (const Expected& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(Snapshot, WrongUseIsExplained) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("wrong_use", comm);
  const fs::path path = folder.path() / "snap_0000.hdf";
  ParticleOutput particles = test::scattered_particles(500, comm);

  const std::vector<std::string> unknown{"Presure"};
  expect_error<UsageError>([&] { write_snapshot(path, {}, particles, unknown, comm); }, "did you mean 'Pressure'");

  const bool mine = std::ranges::find(particles.id, 7U) != particles.id.end();
  if (mine) *std::ranges::find(particles.id, 7U) = 8;
  expect_error<NumericsError>([&] { write_snapshot(path, {}, particles, {}, comm); }, "particle id 8 occurs twice");
  if (mine) *std::ranges::find(particles.id, 8U) = 500;
  expect_error<NumericsError>([&] { write_snapshot(path, {}, particles, {}, comm); }, "particle id 500");
  EXPECT_TRUE(test::names_in(folder.path()).empty());
}

TEST(Snapshot, ReadsFilesOfOtherCodes) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("foreign", comm);
  const fs::path path = folder.path() / "particles.hdf";
  const std::uint64_t each = 10;
  const auto size = static_cast<std::uint64_t>(comm.size());
  const h5::Rows rows{each * static_cast<std::uint64_t>(comm.rank()), each};
  {
    auto file = h5::File::create(path, comm);
    file.create_group("/PartType0");
    std::vector<double> x(3 * each, 1.5);
    std::vector<double> m(each, static_cast<double>(comm.rank()));
    file.write_rows<double>("/PartType0/Coordinates", {each * size, 3, 0}, rows, x);
    expect_error<IoError>([&] { (void)read_snapshot(folder.path() / "absent.hdf", comm); }, "no such file");
    file.write_rows<double>("/PartType0/Masses", {each * size, 1, 0}, rows, m);
    file.close();
  }
  const Snapshot snapshot = read_snapshot(path, comm);
  EXPECT_EQ(snapshot.header.cell, 0.0);
  ASSERT_EQ(snapshot.particles.size(), each);
  EXPECT_EQ(snapshot.particles.id.front(), rows.first);
  EXPECT_EQ(snapshot.particles.mass.front(), static_cast<double>(comm.rank()));
  EXPECT_EQ(snapshot.particles.position.back().z, 1.5);
  EXPECT_EQ(snapshot.particles.velocity.size(), each);
}

TEST(Snapshot, BadFilesAreNamed) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("bad_files", comm);
  if (comm.is_root()) std::ofstream(folder.path() / "notes.txt") << "no snapshot";
  comm.barrier();
  expect_error<IoError>([&] { (void)read_snapshot(folder.path() / "notes.txt", comm); }, "notes.txt: not an HDF5 file");
  {
    auto file = h5::File::create(folder.path() / "empty.hdf", comm);
    file.close();
  }
  expect_error<IoError>([&] { (void)read_snapshot(folder.path() / "empty.hdf", comm); },
                        "empty.hdf: no dataset /PartType0/Coordinates");
}

}  // namespace
}  // namespace breccia::io

// Particles of bodies: counts, masses, motion, shares of ranks, bodies from files.
#include "scene/bodies.hpp"

#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "scene_file.hpp"

namespace breccia::scene {
namespace {

// A scene in text, the same on all ranks.
Scene load_shared(const std::string& text) {
  const mpi::Comm comm;
  const test::Folder folder;
  return load_scene(folder.write("scene.toml", text), {}, comm).scene;
}

struct Totals {
  double count, mass;
  Vec3d first, momentum, angular_momentum;
};

// Sums over all particles of one body on all ranks.
Totals totals(const ParticleArrays& mine, std::uint32_t body) {
  std::array<double, 11> sums{};
  for (std::size_t i = 0; i < mine.size(); ++i) {
    if (mine.body[i] != body) continue;
    const Vec3d p = mine.mass[i] * mine.velocity[i];
    const Vec3d mx = mine.mass[i] * mine.position[i];
    const Vec3d l = cross(mine.position[i], p);
    const std::array<double, 11> add{1, mine.mass[i], mx.x, mx.y, mx.z, p.x, p.y, p.z, l.x, l.y, l.z};
    for (std::size_t k = 0; k < add.size(); ++k) sums[k] += add[k];
  }
  mpi::Comm().sum(std::span<double>(sums));
  return {sums[0], sums[1], {sums[2], sums[3], sums[4]}, {sums[5], sums[6], sums[7]}, {sums[8], sums[9], sums[10]}};
}

TEST(Bodies, CountsMassesAndMotionAreExact) {
  const mpi::Comm comm;
  const Scene scene = load_shared(test::kImpact);
  Scene spinning = scene;
  spinning.bodies[0].spin = {0.0, 0.0, 2.0e-4};
  const ParticleArrays mine = make_particles(spinning, comm);
  EXPECT_EQ(comm.sum<std::uint64_t>(mine.size()), scene.bodies[0].particles + scene.bodies[1].particles);
  for (std::uint32_t b = 0; b < 2; ++b) {
    const BodyParameters& body = spinning.bodies[b];
    const Totals sum = totals(mine, b);
    EXPECT_EQ(sum.count, static_cast<double>(body.particles));
    EXPECT_NEAR(sum.mass / body.mass, 1.0, 1e-12);  // rounding of N additions
    const Vec3d off = (1.0 / sum.mass) * sum.first - body.position;
    EXPECT_NEAR(std::sqrt(dot(off, off)) / body.semi_axes.x, 0.0, 1e-11);
    const Vec3d slip = (1.0 / sum.mass) * sum.momentum - body.velocity;
    EXPECT_NEAR(std::sqrt(dot(slip, slip)) / 200.0, 0.0, 1e-11);
  }
  // Spin angular momentum I omega with I = 2/5 M R^2 to the 0.5 % of the lattice.
  const BodyParameters& body = spinning.bodies[0];
  const double spin = totals(mine, 0).angular_momentum.z - totals(make_particles(scene, comm), 0).angular_momentum.z;
  EXPECT_NEAR(spin / (0.4 * body.mass * std::pow(body.semi_axes.x, 2) * 2.0e-4), 1.0, 5e-3);
}

TEST(Bodies, SharesAreContiguousEvenAndIndependentOfRanks) {
  const mpi::Comm comm;
  const Scene scene = load_shared(test::kImpact);
  const ParticleArrays mine = make_particles(scene, comm);
  const ParticleArrays whole = make_particles(scene, mpi::Comm(MPI_COMM_SELF));
  const std::uint64_t first = comm.exclusive_scan(mine.size());
  const auto ranks = static_cast<std::uint64_t>(comm.size());
  EXPECT_NEAR(static_cast<double>(mine.size()), static_cast<double>(whole.size()) / static_cast<double>(ranks), 1.0);
  for (std::size_t i = 0; i < mine.size(); ++i) {
    ASSERT_EQ(mine.id[i], first + i);
    ASSERT_EQ(whole.id[first + i], first + i);
    ASSERT_EQ(mine.body[i], mine.id[i] < scene.bodies[1].first_id ? 0U : 1U);
    ASSERT_EQ(mine.position[i].x, whole.position[first + i].x);
    ASSERT_EQ(mine.position[i].y, whole.position[first + i].y);
    ASSERT_EQ(mine.velocity[i].z, whole.velocity[first + i].z);
  }
}

TEST(Bodies, MoreRanksThanParticlesIsFine) {
  const mpi::Comm comm;
  Scene scene = load_shared(test::kSphere + "particles = 1\ndamage = 1\n");
  const ParticleArrays mine = make_particles(scene, comm);
  EXPECT_EQ(comm.sum<std::uint64_t>(mine.size()), 1U);
  if (!mine.id.empty()) {
    EXPECT_EQ(mine.damage[0], 1.0);
    EXPECT_NEAR(dot(mine.position[0], mine.position[0]), 0.0, 1e-6);
  }
}

void write_dataset(hid_t group, const char* name, const std::vector<double>& values, hsize_t columns) {
  const std::array<hsize_t, 2> size{values.size() / columns, columns};
  const hid_t space = H5Screate_simple(columns == 1 ? 1 : 2, size.data(), nullptr);
  const hid_t set = H5Dcreate2(group, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  H5Dclose(set);
  H5Sclose(space);
}

struct RubbleFile {
  std::vector<double> x, v, m, damage;
  void write(const std::string& path) const {
    const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t group = H5Gcreate2(file, "/PartType0", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    write_dataset(group, "Coordinates", x, 3);
    write_dataset(group, "Velocities", v, 3);
    write_dataset(group, "Masses", m, 1);
    if (!damage.empty()) write_dataset(group, "Damage", damage, 1);
    H5Gclose(group);
    H5Fclose(file);
  }
};

// Three particles in a row, the heavy one in the middle of a rotation.
RubbleFile rubble() {
  return {{100, 0, 0, 103, 0, 0, 109, 0, 0}, {5, -1, 0, 5, 0, 0, 5, 2, 0}, {2e4, 6e4, 1e4}, {0.25, 1, 0}};
}

std::string file_scene(const std::string& path, const std::string& more = "") {
  return "[scene]\nend = \"1 s\"\n[grid]\ncell = \"3 m\"\n[[body]]\nshape = \"particles\"\nfile = \"" + path + "\"\n" +
         more;
}

TEST(Bodies, ParticleFilesKeepTheirMotion) {
  const mpi::Comm comm;
  const test::Folder folder;
  const std::string path = (folder.path() / "rubble.hdf").string();
  rubble().write(path);
  comm.barrier();
  const Scene as_is = load_scene(folder.write("a.toml", file_scene(path)), {}, mpi::Comm(MPI_COMM_SELF)).scene;
  EXPECT_EQ(as_is.bodies[0].particles, 3U);
  EXPECT_DOUBLE_EQ(as_is.bodies[0].mass, 9e4);
  const ParticleArrays all = make_particles(as_is, mpi::Comm(MPI_COMM_SELF));
  const RubbleFile file = rubble();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(all.position[i].x, file.x[3 * i], 1e-12);
    EXPECT_NEAR(all.velocity[i].y, file.v[3 * i + 1], 1e-12);
    EXPECT_EQ(all.mass[i], file.m[i]);
    EXPECT_EQ(all.damage[i], file.damage[i]);
  }
  // position and velocity are those of the centre of mass, (2 x 100 + 6 x 103 + 109)/9 = 103 m in the file.
  const std::string moved =
      file_scene(path, "position = [\"0\", \"7 m\", \"0\"]\nvelocity = [\"1 m/s\", \"0\", \"0\"]\n");
  const Scene scene = load_scene(folder.write("b.toml", moved), {}, mpi::Comm(MPI_COMM_SELF)).scene;
  const ParticleArrays shifted = make_particles(scene, mpi::Comm(MPI_COMM_SELF));
  EXPECT_NEAR(shifted.position[0].x, -3.0, 1e-12);
  EXPECT_NEAR(shifted.position[0].y, 7.0, 1e-12);
  EXPECT_NEAR(shifted.velocity[2].x, 1.0, 1e-12);
  EXPECT_NEAR(shifted.velocity[2].y, 2.0, 1e-12);
}

TEST(Bodies, BadParticleFilesAreOneLine) {
  const test::Folder folder;
  const auto error_of = [&](const std::string& file) -> std::string {
    try {
      load_scene(folder.write("scene.toml", file_scene(file)), {});
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(error_of("absent.hdf").find("cannot be opened as an HDF5 file"), std::string::npos);
  EXPECT_NE(error_of("absent.hdf").find("scene.toml:7: body[0].file"), std::string::npos);
  folder.write("text.hdf", "not HDF5");
  EXPECT_NE(error_of("text.hdf").find("cannot be opened as an HDF5 file"), std::string::npos);
  RubbleFile bad = rubble();
  bad.m[1] = -1.0;
  bad.write((folder.path() / "negative.hdf").string());
  EXPECT_NE(error_of("negative.hdf").find("particle 1 has the mass -1 kg"), std::string::npos);
  bad = rubble();
  bad.x[4] = std::nan("");
  bad.write((folder.path() / "nan.hdf").string());
  EXPECT_NE(error_of("nan.hdf").find("particle 1 is not finite"), std::string::npos);
  bad = rubble();
  bad.m.pop_back();
  bad.write((folder.path() / "short.hdf").string());
  EXPECT_NE(error_of("short.hdf").find("differ in length"), std::string::npos);
}

TEST(Bodies, ParticleFilesOverlapToo) {
  const test::Folder folder;
  rubble().write((folder.path() / "rubble.hdf").string());
  const auto with_stone_at = [&](const std::string& x) {
    const std::string stone =
        "[[body]]\nshape = \"sphere\"\nradius = \"1 m\"\nparticles = 100\nposition = [\"" + x + "\", \"0\", \"0\"]\n";
    return load_scene(folder.write("scene.toml", file_scene("rubble.hdf", stone)), {});
  };
  EXPECT_NO_THROW(with_stone_at("106 m"));
  EXPECT_THROW(with_stone_at("103 m"), UsageError);
}

}  // namespace
}  // namespace breccia::scene

// Writes a snapshot that looks like a result: a contact binary of two bodies with ejecta. For the tests of the Python
// tools. Usage: io_write_sample FILE PARTICLES
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "breccia/constants.hpp"
#include "breccia/error.hpp"
#include "io/snapshot.hpp"

namespace {

using namespace breccia;

// A particle at a random place in a sphere, or thrown out of it.
Vec3d place(std::mt19937_64& random, Vec3d centre, double radius, bool ejected) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const double z = 2.0 * uniform(random) - 1.0;
  const double phi = 2.0 * kPi * uniform(random);
  const double r = radius * (ejected ? 1.0 / std::sqrt(uniform(random)) : std::cbrt(uniform(random)));
  const double s = std::sqrt(1.0 - z * z);
  return centre + r * Vec3d{s * std::cos(phi), s * std::sin(phi), 0.8 * z};
}

ParticleOutput contact_binary(std::uint64_t total, const mpi::Comm& comm) {
  std::mt19937_64 random(1);
  ParticleOutput out;
  for (std::uint64_t id = 0; id < total; ++id) {
    const bool second = id >= 2 * total / 3;
    const Vec3d centre = second ? Vec3d{6.6e4, 1.5e4, 5.0e3} : Vec3d{-2.0e4, 0.0, 0.0};
    const double radius = second ? 3.6e4 : 5.0e4;
    const Vec3d position = place(random, centre, radius, id % 40 == 0);
    if (id % static_cast<std::uint64_t>(comm.size()) != static_cast<std::uint64_t>(comm.rank())) continue;
    out.id.push_back(id);
    out.position.push_back(position);
    out.velocity.push_back(0.001 * (position - centre));
    out.mass.push_back(1.41e18 / static_cast<double>(total));
    out.body.push_back(second ? 1 : 0);
    out.material.push_back(0);
    out.damage.push_back(1.0 - std::exp(-std::abs(position.x - 2.5e4) / 2.0e4));
    out.internal_energy.push_back(1.0e4 * std::exp(-std::abs(position.x - 2.5e4) / 1.0e4));
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  const mpi::Environment environment(&argc, &argv);
  const mpi::Comm comm;
  io::SnapshotHeader header;
  header.time = 1.0e5;
  header.step = 819200;
  header.cell = 2500.0;
  header.scene_name = "contact binary";
  header.scene_keys = R"({"body[0].name": "target", "body[1].name": "impactor"})";
  try {
    const ParticleOutput particles = contact_binary(std::strtoull(argv[2], nullptr, 10), comm);
    const double start = MPI_Wtime();
    io::write_snapshot(argv[1], header, particles, {}, comm);
    if (comm.is_root()) std::printf("written in %.3f s\n", MPI_Wtime() - start);
  } catch (const Error& error) {
    if (comm.is_root()) std::fprintf(stderr, "error: %s\n", error.what());
    return static_cast<int>(error.code());
  }
  return 0;
}

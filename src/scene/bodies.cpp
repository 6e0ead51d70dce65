#include "scene/bodies.hpp"

#include <algorithm>
#include <optional>
#include <string>

#include "breccia/error.hpp"
#include "scene/body_points.hpp"
#include "scene/particle_file.hpp"

namespace breccia::scene {

namespace {

struct IdRange {
  std::uint64_t begin;
  std::uint64_t end;
};

// Shares of all ids that differ by one at most.
IdRange share_of_rank(std::uint64_t total, const mpi::Comm& comm) {
  const auto ranks = static_cast<std::uint64_t>(comm.size());
  const auto rank = static_cast<std::uint64_t>(comm.rank());
  const auto begin = [&](std::uint64_t r) { return total / ranks * r + std::min(r, total % ranks); };
  return {begin(rank), begin(rank + 1)};
}

// One particle of a body, placed relative to its centre of mass.
void append(ParticleArrays& all, const Scene& scene, std::uint32_t index, std::uint64_t number, const Vec3d& x,
            double mass, double damage) {
  const BodyParameters& body = scene.bodies[index];
  all.id.push_back(body.first_id + number);
  all.position.push_back(body.position + x);
  all.velocity.push_back(body.velocity + cross(body.spin, x));
  all.mass.push_back(mass);
  all.body.push_back(index);
  all.material.push_back(body.material);
  all.damage.push_back(damage);
}

void append_lattice(ParticleArrays& all, const Scene& scene, std::uint32_t index, IdRange numbers) {
  const BodyParameters& body = scene.bodies[index];
  const double mass = body.mass / static_cast<double>(body.particles);
  std::uint64_t number = numbers.begin;
  for (const Vec3d& x : body_lattice(scene, index).points(numbers.begin, numbers.end))
    append(all, scene, index, number++, x, mass, body.damage);
}

// The file's own motion and damage, relative to its centre of mass, on top of those of the body.
void append_file(ParticleArrays& all, const Scene& scene, std::uint32_t index, IdRange numbers,
                 const ParticleFileSummary& summary) {
  const BodyParameters& body = scene.bodies[index];
  const ParticleFileSlice slice = read_particle_file(body.file, numbers.begin, numbers.end - numbers.begin);
  for (std::size_t i = 0; i < slice.mass.size(); ++i) {
    const double damage = slice.damage.empty() ? body.damage : std::max(body.damage, slice.damage[i]);
    append(all, scene, index, numbers.begin + i, slice.position[i] - summary.centre, slice.mass[i], damage);
    all.velocity.back() += slice.velocity[i] - summary.velocity;
  }
}

// Local failure of one rank becomes the failure of all.
void throw_together(const std::optional<std::string>& problem, const mpi::Comm& comm) {
  if (!comm.any(problem.has_value())) return;
  throw IoError(problem.value_or("another rank could not read its particles"));
}

}  // namespace

ParticleArrays make_particles(const Scene& scene, const mpi::Comm& comm) {
  std::uint64_t total = 0;
  for (const BodyParameters& body : scene.bodies) total += body.particles;
  const IdRange share = share_of_rank(total, comm);

  ParticleArrays all;
  std::optional<std::string> problem;
  for (std::uint32_t index = 0; index < scene.bodies.size(); ++index) {
    const BodyParameters& body = scene.bodies[index];
    std::optional<ParticleFileSummary> summary;
    if (body.shape == Shape::kParticles) summary = shared_file_summary(body.file, &comm);
    const std::uint64_t begin = std::max(share.begin, body.first_id);
    const std::uint64_t end = std::min(share.end, body.first_id + body.particles);
    if (begin >= end || problem) continue;
    const IdRange numbers{begin - body.first_id, end - body.first_id};
    try {
      summary ? append_file(all, scene, index, numbers, *summary) : append_lattice(all, scene, index, numbers);
    } catch (const IoError& error) {
      problem = error.what();
    }
  }
  throw_together(problem, comm);
  return all;
}

}  // namespace breccia::scene

#include "analysis/bound_mass.hpp"

#include <array>
#include <cmath>
#include <vector>

#include "breccia/constants.hpp"

namespace breccia::analysis {
namespace {

// Two sets that take turns would go on for ever; real ones settle within a few rounds.
constexpr int kMostRounds = 50;

struct BoundSet {
  double mass = 0.0;
  Vec3d position{}, velocity{};
};

BoundSet centre_of_mass(const ParticleArrays& particles, const std::vector<char>& bound, const mpi::Comm& comm) {
  std::array<double, 7> sums{};
  for (std::size_t i = 0; i < bound.size(); ++i) {
    if (bound[i] == 0) continue;
    const double m = particles.mass[i];
    const Vec3d x = m * particles.position[i];
    const Vec3d v = m * particles.velocity[i];
    const double terms[7] = {m, x.x, x.y, x.z, v.x, v.y, v.z};
    for (std::size_t k = 0; k < 7; ++k) sums[k] += terms[k];
  }
  comm.sum(std::span<double>(sums));
  if (!(sums[0] > 0.0)) return {};
  const double per_mass = 1.0 / sums[0];
  return {sums[0], per_mass * Vec3d{sums[1], sums[2], sums[3]}, per_mass * Vec3d{sums[4], sums[5], sums[6]}};
}

}  // namespace

double bound_mass(const ParticleArrays& particles, std::span<const std::uint64_t> labels, std::uint64_t label,
                  std::span<const double> potential, const mpi::Comm& comm) {
  std::vector<char> bound(particles.size());
  for (std::size_t i = 0; i < bound.size(); ++i) bound[i] = labels[i] == label ? 1 : 0;
  BoundSet set = centre_of_mass(particles, bound, comm);
  bool changed = true;
  for (int round = 0; round < kMostRounds && comm.any(changed); ++round) {
    changed = false;
    for (std::size_t i = 0; i < bound.size(); ++i) {
      const Vec3d v = particles.velocity[i] - set.velocity;
      const Vec3d x = particles.position[i] - set.position;
      const bool from_field = !potential.empty() && labels[i] == label;
      const double phi = from_field ? potential[i] : -kGravitationalConstant * set.mass / std::sqrt(dot(x, x));
      const char now = 0.5 * dot(v, v) + phi < 0.0 ? 1 : 0;
      changed = changed || now != bound[i];
      bound[i] = now;
    }
    set = centre_of_mass(particles, bound, comm);
  }
  return set.mass;
}

}  // namespace breccia::analysis

#include "analysis/remnants.hpp"

#include <cmath>
#include <limits>
#include <string>

#include "analysis/bound_mass.hpp"
#include "analysis/fof.hpp"
#include "analysis/trimmed_extent.hpp"
#include "breccia/constants.hpp"
#include "breccia/error.hpp"

namespace breccia::analysis {
namespace {

// omega = I^-1 L in the principal frame; about an axis without inertia (a line of points) there is no spin.
Vec3d spin_of(const Ellipsoid& ellipsoid, Vec3d angular_momentum) {
  Vec3d spin{};
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(ellipsoid.moment[k] > 0.0)) continue;
    spin += (dot(angular_momentum, ellipsoid.axis[k]) / ellipsoid.moment[k]) * ellipsoid.axis[k];
  }
  return spin;
}

Remnant describe(const GroupSums& group, double target_mass) {
  const Ellipsoid ellipsoid = equivalent_ellipsoid(group.second_moment, group.mass, group.particles);
  Remnant remnant;
  remnant.label = group.label;
  remnant.particles = group.particles;
  remnant.mass = group.mass;
  remnant.mass_over_target = group.mass / target_mass;
  remnant.position = group.position;
  remnant.velocity = group.velocity;
  remnant.angular_momentum = group.angular_momentum;
  remnant.spin = spin_of(ellipsoid, group.angular_momentum);
  const double rate = std::sqrt(dot(remnant.spin, remnant.spin));
  remnant.spin_period = rate > 0.0 ? 2.0 * kPi / rate : std::numeric_limits<double>::infinity();
  remnant.a = ellipsoid.length[0];
  remnant.b = ellipsoid.length[1];
  remnant.c = ellipsoid.length[2];
  remnant.b_over_a = ellipsoid.b_over_a;
  remnant.c_over_a = ellipsoid.c_over_a;
  remnant.axes = ellipsoid.axis;
  remnant.bound_mass = std::numeric_limits<double>::quiet_NaN();
  remnant.shape = classify(remnant.mass_over_target, remnant.b_over_a, remnant.c_over_a);
  remnant.shape_195 = classify(remnant.mass_over_target, remnant.b_over_a, remnant.c_over_a, 1.95);
  remnant.shape_190 = classify(remnant.mass_over_target, remnant.b_over_a, remnant.c_over_a, 1.90);
  return remnant;
}

// What is worth a second pass over the particles for the largest one only.
void complete(Remnant& largest, const ParticleArrays& particles, std::span<const std::uint64_t> label,
              std::span<const double> potential, const mpi::Comm& comm) {
  std::vector<Vec3d> members;
  for (std::size_t i = 0; i < label.size(); ++i) {
    if (label[i] == largest.label) members.push_back(particles.position[i] - largest.position);
  }
  largest.trimmed_extent = trimmed_extent(members, largest.axes, comm);
  largest.bound_mass = bound_mass(particles, label, largest.label, potential, comm);
}

}  // namespace

Fragments find_fragments(const ParticleArrays& particles, double link, double target_mass, const mpi::Comm& comm,
                         std::span<const double> potential) {
  if (!(target_mass > 0.0)) {
    throw UsageError("analysis: target mass " + std::to_string(target_mass) + " kg must be positive");
  }
  const std::vector<std::uint64_t> label = find_groups(particles.position, particles.id, link, comm);
  const Groups groups = sum_groups(particles, label, comm);
  Fragments fragments{{}, groups.singles};
  fragments.remnants.reserve(groups.groups.size());
  for (const GroupSums& group : groups.groups) fragments.remnants.push_back(describe(group, target_mass));
  if (!fragments.remnants.empty()) complete(fragments.remnants.front(), particles, label, potential, comm);
  return fragments;
}

std::vector<Remnant> find_remnants(const ParticleArrays& particles, double link, double target_mass,
                                   const mpi::Comm& comm) {
  return find_fragments(particles, link, target_mass, comm).remnants;
}

}  // namespace breccia::analysis

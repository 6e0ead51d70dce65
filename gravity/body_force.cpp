#include "gravity/body_force.hpp"

#include <algorithm>
#include <cmath>

#include "breccia/constants.hpp"

namespace breccia::gravity {
namespace {

// Measured (docs/performance.md, "Net force on bodies"): the net force of a tree on a lone body, over its mass and its
// own gravity, root mean square over random roots, for openings of 1.2e-4 and bodies of 47,000 particles.
constexpr double kOwnForce = 4.5e-6;
constexpr double kUsualOpening = 1.2e-4;
constexpr double kUsualParticles = 47'000.0;

// Of mesh and near field: roundings of float.
constexpr double kMeshForce = 1e-7;

// It grows as the errors of single particles do, with opening^(1/1.9); more particles leave less, up to a body that has
// as many cells as an opening asks for.
double own_force(const DenseBody& body, double opening) {
  const double particles = std::clamp(static_cast<double>(body.particles), 1.0, kUsualParticles);
  return kOwnForce * std::pow(opening / kUsualOpening, 1.0 / 1.9) * std::cbrt(kUsualParticles / particles);
}

double felt_pull(const DenseBody& body) { return std::max(body.pull, kLeastPull); }

}  // namespace

std::vector<DenseBody> weigh(std::span<const PlacedBody> bodies, double all_mass) {
  std::vector<DenseBody> weighed;
  for (const PlacedBody& body : bodies) {
    Vec3d pull{};
    for (const PlacedBody& other : bodies) {
      const Vec3d d = other.centre - body.centre;
      const double d2 = dot(d, d);
      if (d2 > 0.0) pull += (other.mass / (d2 * std::sqrt(d2))) * d;
    }
    // Inside a sphere |a| grows with the distance from its centre: its mean is 3/4 of that at the surface.
    const double radius = std::cbrt(0.75 / kPi * body.volume);
    const double own = 0.75 * body.mass / (radius * radius);
    weighed.push_back({.particles = body.particles,
                       .mass_share = body.mass / all_mass,
                       .pull = own > 0.0 ? std::sqrt(dot(pull, pull)) / own : 0.0});
  }
  return weighed;
}

// Taken off all particles, the net force of the body is left to the share of the others; and of theirs, which is as
// large for their mass, the body takes its share.
double body_error_of_tree(std::span<const DenseBody> bodies, double opening) {
  double worst = 0.0;
  for (const DenseBody& body : bodies) {
    const double left = std::sqrt(2.0) * (1.0 - body.mass_share) * own_force(body, opening);
    worst = std::max(worst, left / felt_pull(body));
  }
  return worst;
}

// Only what is in no body has a force by itself.
double body_error_of_mesh(std::span<const DenseBody> bodies, double opening) {
  double outside = 1.0;
  for (const DenseBody& body : bodies) outside -= body.mass_share;
  double worst = 0.0;
  for (const DenseBody& body : bodies) {
    const double taken = std::hypot(std::max(outside, 0.0) * own_force(body, opening), kMeshForce);
    worst = std::max(worst, taken / felt_pull(body));
  }
  return worst;
}

}  // namespace breccia::gravity

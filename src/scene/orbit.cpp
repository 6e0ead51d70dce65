#include "scene/orbit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "breccia/constants.hpp"
#include "breccia/error.hpp"

namespace breccia::scene {

namespace {

// Conserved quantities of the relative motion and what follows from them at a distance r.
struct Orbit {
  double energy;            ///< v^2/2 - mu/r [J/kg]
  double angular_momentum;  ///< r v_t [m2/s]
  double mu;

  /// Squared radial speed; negative beyond an apsis.
  [[nodiscard]] double radial_speed_squared(double r) const {
    const double transverse = angular_momentum / r;
    return 2.0 * (energy + mu / r) - transverse * transverse;
  }
  /// True anomaly on the inbound leg, from e cos(nu) = h^2/(mu r) - 1 and e sin(nu) = h v_r/mu. Both are taken times
  /// mu, which keeps straight lines (mu = 0) in the same formula.
  [[nodiscard]] double true_anomaly(double r, double radial_velocity) const {
    const double h = angular_momentum;
    return std::atan2(h * radial_velocity, h * h / r - mu);
  }
};

// Integral of dr/|v_r|. The substitution r = middle - half cos(psi) removes the square-root singularity of a turning
// point at either end; the midpoint rule then converges quickly. v_r^2 is that at contact plus a difference without
// cancellation, so that an encounter a hair long has its time as well.
double time_between(const Orbit& orbit, double r1, double r0, double radial_at_contact) {
  constexpr int kSteps = 4096;
  const double h = orbit.angular_momentum;
  const double half = 0.5 * (r0 - r1);
  double time = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double psi = kPi * (i + 0.5) / kSteps;
    const double sine = std::sin(0.5 * psi);
    const double way = 2.0 * half * sine * sine;  // r - r1
    const double r = r1 + way;
    const double gained = way / (r * r1) * (h * h * (r + r1) / (r * r1) - 2.0 * orbit.mu);
    const double squared = radial_at_contact * radial_at_contact + gained;
    // Rounding may put the start beyond the apocentre, where no time is spent.
    if (squared > 0.0) time += std::sin(psi) / std::sqrt(squared);
  }
  return time * half * kPi / kSteps;
}

// Farthest point of a bound orbit: the larger root of v_r^2 = 0.
double apocentre(const Orbit& orbit) {
  const double h = orbit.angular_momentum;
  const double root = std::sqrt(std::max(0.0, orbit.mu * orbit.mu + 2.0 * orbit.energy * h * h));
  return (orbit.mu + root) / (-2.0 * orbit.energy);
}

}  // namespace

ImpactOrbit back_calculate(const ImpactParameters& impact, double contact_distance, double mu) {
  const double r1 = contact_distance;
  const double r0 = impact.separation;
  if (r0 < r1) {
    throw UsageError(
        fmt::format("impact.separation {:.6g} m is below the contact distance {:.6g} m (sum of the radii)", r0, r1));
  }
  const double v = impact.velocity;
  const Orbit orbit{0.5 * v * v - mu / r1, r1 * v * std::sin(impact.angle), mu};

  // A separation at the apocentre itself may come out slightly beyond it.
  const double rounding = 1.0e-12 * (v * v + 2.0 * mu / r1);
  const double radial_squared = orbit.radial_speed_squared(r0);
  if (radial_squared < -rounding) {
    throw UsageError(
        fmt::format("bodies that meet at {:.6g} m/s were never farther apart than {:.6g} m (apocentre); "
                    "impact.separation is {:.6g} "
                    "m: make it smaller or impact.velocity larger",
                    v, std::max(apocentre(orbit), r1), r0));
  }
  const double radial = -std::sqrt(std::max(radial_squared, 0.0));
  const double radial_at_contact = -v * std::cos(impact.angle);
  const double transverse = orbit.angular_momentum / r0;
  const double phi = orbit.true_anomaly(r0, radial) - orbit.true_anomaly(r1, radial_at_contact);
  const Vec3d outward{std::cos(phi), std::sin(phi), 0.0};
  const Vec3d sideways{-outward.y, outward.x, 0.0};
  return {r0 * outward, radial * outward + transverse * sideways,
          r0 > r1 ? time_between(orbit, r1, r0, radial_at_contact) : 0.0};
}

double equal_volume_radius(const BodyParameters& body, double density) {
  return std::cbrt(body.mass / density * 3.0 / (4.0 * kPi));
}

double compactness(const Scene& scene) {
  double mass = 0.0;
  double volume = 0.0;
  double sound_speed_squared = std::numeric_limits<double>::infinity();
  for (const BodyParameters& body : scene.bodies) {
    const TillotsonParameters& eos = scene.materials[body.material].eos;
    mass += body.mass;
    volume += body.mass / eos.rho0;
    sound_speed_squared = std::min(sound_speed_squared, eos.A / eos.rho0);
  }
  const double radius = std::cbrt(volume * 3.0 / (4.0 * kPi));
  return kGravitationalConstant * mass / (radius * sound_speed_squared);
}

double place_on_orbit(Scene& scene) {
  BodyParameters& first = scene.bodies[0];
  BodyParameters& second = scene.bodies[1];
  const double total = first.mass + second.mass;
  const bool gravity = scene.effects.gravity == GravityMethod::kAuto ? compactness(scene) >= kNegligibleCompactness
                                                                     : scene.effects.gravity != GravityMethod::kOff;
  const double contact_distance = equal_volume_radius(first, scene.materials[first.material].eos.rho0) +
                                  equal_volume_radius(second, scene.materials[second.material].eos.rho0);
  if (scene.impact->separation == 0.0) scene.impact->separation = 2.0 * contact_distance;
  const ImpactOrbit orbit =
      back_calculate(*scene.impact, contact_distance, gravity ? kGravitationalConstant * total : 0.0);
  first.position = (second.mass / total) * orbit.position;
  first.velocity = (second.mass / total) * orbit.velocity;
  second.position = (-first.mass / total) * orbit.position;
  second.velocity = (-first.mass / total) * orbit.velocity;
  return orbit.time_to_contact;
}

}  // namespace breccia::scene

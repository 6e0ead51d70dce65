// Where two bodies must start to meet with a given speed and angle: two-body motion run backwards (physics.md 6).
#pragma once

#include "breccia/linalg.hpp"
#include "breccia/scene.hpp"

namespace breccia::scene {

/// Relative motion (body 0 minus body 1) in the xy plane; at contact the line of centres is the x axis and the relative
/// velocity is v (-cos angle, sin angle).
struct ImpactOrbit {
  Vec3d position;          ///< relative position at the start [m]
  Vec3d velocity;          ///< relative velocity at the start [m/s]
  double time_to_contact;  ///< [s]
};

/// Runs the Kepler problem of parameter `mu` = G (M1 + M2) [m3/s2] back from `contact_distance` [m] to
/// impact.separation. mu = 0 gives straight lines. Throws UsageError (without place) if the separation is below the
/// contact distance or beyond the apocentre of the orbit.
ImpactOrbit back_calculate(const ImpactParameters& impact, double contact_distance, double mu);

/// Radius of the sphere that has the volume of the body [m].
double equal_volume_radius(const BodyParameters& body, double density);

/// G M / (R c0^2) of the whole scene: total mass, equal-volume radius of all matter, smallest c0 = sqrt(A/rho0).
/// Below kNegligibleCompactness gravity = "auto" means off.
double compactness(const Scene& scene);
inline constexpr double kNegligibleCompactness = 1.0e-9;

/// Places the two bodies of `scene` on the orbit of scene.impact, centre of mass at rest at the origin.
/// Needs the masses of the bodies; gravity counts unless it is off or negligible. Returns the time to contact [s].
double place_on_orbit(Scene& scene);

}  // namespace breccia::scene

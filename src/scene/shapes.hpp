// Geometry of the analytic shapes, centred on the origin; semi_axes as in BodyParameters.
#pragma once

#include "breccia/scene.hpp"

namespace breccia::scene {

/// Volume [m3].
double shape_volume(Shape shape, const Vec3d& semi_axes);

/// Factor by which the shape must be scaled to have x on its surface: below 1 inside, above 1 outside.
double scaled_radius(Shape shape, const Vec3d& semi_axes, const Vec3d& x);

/// Mean x^2, y^2, z^2 over the volume [m2].
Vec3d second_moments(Shape shape, const Vec3d& semi_axes);

/// Largest normal . x over the shape: how far it reaches in the direction of the unit vector `normal` [m].
double support(Shape shape, const Vec3d& semi_axes, const Vec3d& normal);

}  // namespace breccia::scene

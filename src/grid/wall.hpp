// What a wall does to the velocity of a node: the same on every device.
#pragma once

#include "breccia/math.hpp"
#include "breccia/scene.hpp"

namespace breccia::grid {

/// Whether the node at x [m] lies on or behind the wall. A node on the plane belongs to it; rounding of x must not
/// decide.
BRECCIA_HD bool holds_node(const BoundaryPlane& wall, Vec3d x, double cell) {
  return dot(x - wall.point, wall.normal) <= 1e-6 * cell;
}

/// The velocity a wall allows at a node inside it.
BRECCIA_HD Vec3d constrained(const BoundaryPlane& wall, Vec3d v) {
  if (wall.kind == BoundaryKind::kStick) return {};
  const double along_normal = dot(v, wall.normal);
  const Vec3d tangential = v - along_normal * wall.normal;
  if (wall.kind == BoundaryKind::kSlip) return tangential;
  if (along_normal >= 0.0) return v;
  const double speed = breccia::sqrt(dot(tangential, tangential));
  const double lost = -wall.friction * along_normal;
  return speed > lost ? (1.0 - lost / speed) * tangential : Vec3d{};
}

}  // namespace breccia::grid

// Mass, centre and second moment of a cell from its particles or its parts, on host and device.
#pragma once

#include <cmath>

#include "gravity/tree/cell.hpp"

namespace breccia::gravity {

/// The radius of cells of more particles follows from their children.
inline constexpr std::int64_t kExactRadius = 4096;

/// What encloses particles at this square of a distance. Rounded up: a particle must not stick out.
BRECCIA_HD double enclosing_radius(double farthest_squared) { return std::sqrt(farthest_squared) * (1.0 + 1e-12); }

BRECCIA_HD Sym3<double> outer_square(Vec3d d) {
  return {d.x * d.x, d.y * d.y, d.z * d.z, d.x * d.y, d.x * d.z, d.y * d.z};
}

/// Of a leaf: position_of(i) and mass_of(i) of its particles. Without mass the centre is that of the positions.
template <class Position, class Mass>
BRECCIA_HD void set_leaf_moments(Cell& cell, Position&& position_of, Mass&& mass_of) {
  Vec3d weighted{};
  Vec3d mean{};
  double mass = 0.0;
  for (std::int64_t i = cell.begin; i < cell.end; ++i) {
    const double m = mass_of(i);
    const Vec3d x = position_of(i);
    mass += m;
    weighted += m * x;
    mean += x;
  }
  cell.centre = mass > 0.0 ? (1.0 / mass) * weighted : (1.0 / static_cast<double>(cell.end - cell.begin)) * mean;
  cell.moments = {mass, {}};
  for (std::int64_t i = cell.begin; i < cell.end; ++i) {
    cell.moments.second = cell.moments.second + mass_of(i) * outer_square(position_of(i) - cell.centre);
  }
}

/// Of an inner cell, with a radius that is up to twice too large; `children` are cell.children cells.
BRECCIA_HD void combine_children(Cell& cell, const Cell* children) {
  Vec3d weighted{};
  Vec3d mean{};
  double mass = 0.0;
  for (std::int32_t k = 0; k < cell.children; ++k) {
    const Cell& child = children[k];
    mass += child.moments.mass;
    weighted += child.moments.mass * child.centre;
    mean += static_cast<double>(child.count) * child.centre;
  }
  cell.centre = mass > 0.0 ? (1.0 / mass) * weighted : (1.0 / static_cast<double>(cell.count)) * mean;
  cell.moments = {mass, {}};
  double radius = 0.0;
  for (std::int32_t k = 0; k < cell.children; ++k) {
    const Cell& child = children[k];
    const Vec3d d = child.centre - cell.centre;
    cell.moments.second = cell.moments.second + child.moments.second + child.moments.mass * outer_square(d);
    const double reach = std::sqrt(dot(d, d)) + child.radius;
    radius = reach > radius ? reach : radius;
  }
  cell.radius = radius;
}

}  // namespace breccia::gravity

// When a cell may stand for its particles (gravity.md 5.3): the error of its field must stay below a fraction of the
// acceleration the targets feel.
#pragma once

#include <cmath>

#include "gravity/tree/tree.hpp"

namespace breccia::gravity {

/// Expansions converge for (source radius + target radius) / distance < 1; beyond this they do not pay.
inline constexpr double kLargestOpening = 0.8;

/// Error of expanding the field of `source` around the centre of `target` against `largest_error`, in units of
/// mass/length^2: all terms of the fourth order, of which x = (b + R)/D bounds the ratio, and the octupole at b/D.
inline bool expandable(const Cell& source, const Cell& target, double largest_error) {
  const Vec3d d = target.centre - source.centre;
  const double d2 = dot(d, d);
  const double size = source.radius + target.radius;
  if (size * size >= kLargestOpening * kLargestOpening * d2) return false;
  const double inverse = 1.0 / std::sqrt(d2);
  const double x = size * inverse;
  const double b = source.radius * inverse;
  const double ratio = x * x / (1.0 - x);
  return source.moments.mass * (ratio * ratio + b * b * b) < largest_error * d2;
}

/// Error of monopole and quadrupole of `source` at the particles of `target`: the octupole at the nearest of them.
inline bool visible_whole(const Cell& source, const Cell& target, double largest_error) {
  const Vec3d d = target.centre - source.centre;
  const double nearest = std::sqrt(dot(d, d)) - target.radius;
  if (source.radius >= kLargestOpening * nearest) return false;
  const double b = source.radius / nearest;
  return source.moments.mass * (b * b * b) < largest_error * (nearest * nearest);
}

}  // namespace breccia::gravity

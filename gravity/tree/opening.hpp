// When a cell may stand for its particles (gravity.md 5.3): the error of its field must stay below a fraction of the
// acceleration the targets feel. Errors count in mass/length^2; D is the distance of the centres, b and R the radii of
// source and target.
#pragma once

#include <cmath>
#include <cstdint>

#include "gravity/tree/cell.hpp"

namespace breccia::gravity {

/// Expansions converge for (b + R)/D < 1; beyond this they do not pay.
inline constexpr double kLargestOpening = 0.8;

/// Octupole of a cell in units of M b^3: what cells full of particles typically have. Measured: with the bound 1 in its
/// place, equal errors cost a fifth more.
inline constexpr double kOctupole = 0.1;

/// A cell of so few particles costs less as particles.
inline constexpr std::int64_t kFewParticles = 2;

enum class Opening {
  kOpen,    ///< its children, or its particles
  kWhole,   ///< monopole and quadrupole at each target
  kExpand,  ///< Taylor expansion around the centre of the targets
};

namespace detail {
BRECCIA_HD double square(double x) { return x * x; }

/// All terms of the fourth order, x = (b + R)/D bounding the ratio of one to the next, and the octupole:
/// M (x^4/(1-x)^2 + kOctupole (b/D)^3)/D^2 < largest_error, for x < 1; here without a division.
BRECCIA_HD bool expandable(const Cell& source, double size, double distance, double largest_error) {
  const double b = source.radius;
  const double d2 = distance * distance;
  const double rest = square(distance - size);
  return source.moments.mass * (square(square(size)) * distance + kOctupole * (b * b * b) * rest) <
         largest_error * rest * (d2 * d2 * distance);
}
}  // namespace detail

/// Whether `source` may be expanded around the centre of `target`.
BRECCIA_HD bool expandable(const Cell& source, const Cell& target, double largest_error) {
  const Vec3d d = target.centre - source.centre;
  const double d2 = dot(d, d);
  const double size = source.radius + target.radius;
  if (size * size >= detail::square(kLargestOpening) * d2) return false;
  return detail::expandable(source, size, std::sqrt(d2), largest_error);
}

/// The cheapest way to take `source` for the particles of the group `target`. Seen whole, what is missing is the
/// octupole at the nearest of them: kOctupole M b^3/(D - R)^5 < largest_error.
BRECCIA_HD Opening opening(const Cell& source, const Cell& target, double largest_error) {
  const Vec3d d = target.centre - source.centre;
  const double d2 = dot(d, d);
  if (d2 <= detail::square(target.radius + source.radius / kLargestOpening)) return Opening::kOpen;
  const double distance = std::sqrt(d2);
  const double size = source.radius + target.radius;
  if (size < kLargestOpening * distance && detail::expandable(source, size, distance, largest_error)) {
    return Opening::kExpand;
  }
  const double nearest = distance - target.radius;
  const double b = source.radius;
  const bool whole =
      kOctupole * source.moments.mass * (b * b * b) < largest_error * detail::square(detail::square(nearest)) * nearest;
  return whole ? Opening::kWhole : Opening::kOpen;
}

}  // namespace breccia::gravity

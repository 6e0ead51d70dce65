// When a cell may stand for its particles (gravity.md 5.3): the error of its field must stay below a fraction of the
// acceleration the targets feel. Errors count in mass/length^2; D is the distance of the centres, b and R the radii of
// source and target.
#pragma once

#include <cmath>
#include <cstdint>

#include "breccia/math.hpp"
#include "gravity/tree/cell.hpp"

namespace breccia::gravity {

/// Expansions converge for (b + R)/D < 1; beyond this they do not pay.
inline constexpr double kLargestOpening = 0.8;

/// Octupole of a cell in units of M b^3: what cells full of particles typically have. Measured: with the bound 1 in its
/// place, equal errors cost a fifth more.
inline constexpr double kOctupole = 0.1;

/// A cell of so few particles costs less as particles.
inline constexpr std::int64_t kFewParticles = 2;

/// A group is sparse, and divided, if something larger near it is denser by this factor.
inline constexpr double kDenser = 64.0;

namespace detail {
BRECCIA_HD double cube(double x) { return x * x * x; }
}  // namespace detail

/// Mass over the cube of the radius; a single particle has none to speak of.
BRECCIA_HD double density(const Cell& cell) {
  return cell.radius > 0.0 ? cell.moments.mass / detail::cube(cell.radius) : 0.0;
}

/// Whether a source makes a group near it sparse.
BRECCIA_HD bool outweighs(const Cell& source, const Cell& group) {
  return source.count > group.count && density(source) > kDenser * density(group);
}

enum class Opening : std::uint8_t {
  kOpen,    ///< its children, or its particles
  kWhole,   ///< monopole and quadrupole at each target
  kExpand,  ///< Taylor expansion around the centre of the targets
};

/// What the rules ask of a source and a target; T: double, or a pack of sources.
template <class T>
struct OpeningGeometry {
  T distance_squared;  ///< of the centres
  T source_radius, source_mass;
  T target_radius;
  T largest_error;
};

namespace detail {
template <class T>
BRECCIA_HD T square(T x) {
  return x * x;
}

/// All terms of the fourth order, x = (b + R)/D bounding the ratio of one to the next, and the octupole:
/// M (x^4/(1-x)^2 + kOctupole (b/D)^3)/D^2 < largest_error; here without a division.
template <class T>
BRECCIA_HD auto expandable(const OpeningGeometry<T>& g, T distance) {
  const T b = g.source_radius;
  const T size = b + g.target_radius;
  const T d2 = g.distance_squared;
  const T rest = square(distance - size);
  const auto converges = size < T(kLargestOpening) * distance;
  const auto small = g.source_mass * (square(square(size)) * distance + T(kOctupole) * (b * b * b) * rest) <
                     g.largest_error * rest * (d2 * d2 * distance);
  return converges & small;
}
}  // namespace detail

/// Whether the source may be expanded around the centre of the target.
template <class T>
BRECCIA_HD auto expandable(const OpeningGeometry<T>& g) {
  using std::sqrt;
  return detail::expandable(g, sqrt(g.distance_squared));
}

/// The cheapest way to take the source for the particles of a group, as the number of an Opening. Seen whole, what is
/// missing is the octupole at the nearest of them: kOctupole M b^3/(D - R)^5 < largest_error. Without branches, as
/// nobody could predict them.
template <class T>
BRECCIA_HD T opening_number(const OpeningGeometry<T>& g) {
  using detail::square;
  using std::sqrt;
  const T b = g.source_radius;
  const T distance = sqrt(g.distance_squared);
  const T nearest = distance - g.target_radius;
  const auto apart = g.distance_squared > square(g.target_radius + T(1.0 / kLargestOpening) * b);
  const auto whole = T(kOctupole) * g.source_mass * (b * b * b) < g.largest_error * square(square(nearest)) * nearest;
  const T otherwise = select(apart & whole, T(1), T(0));
  return select(apart & detail::expandable(g, distance), T(2), otherwise);
}

BRECCIA_HD OpeningGeometry<double> opening_geometry(const Cell& source, const Cell& target, double largest_error) {
  const Vec3d d = target.centre - source.centre;
  return {dot(d, d), source.radius, source.moments.mass, target.radius, largest_error};
}

BRECCIA_HD bool expandable(const Cell& source, const Cell& target, double largest_error) {
  return expandable(opening_geometry(source, target, largest_error));
}

BRECCIA_HD Opening opening(const Cell& source, const Cell& target, double largest_error) {
  return static_cast<Opening>(static_cast<int>(opening_number(opening_geometry(source, target, largest_error))));
}

}  // namespace breccia::gravity

// Shape of a group of particles: ellipsoid of equal inertia and class (physics.md 7).
#pragma once

#include <array>
#include <cstdint>

#include "breccia/linalg.hpp"

namespace breccia::analysis {

/// Homogeneous ellipsoid with the inertia tensor of the group.
struct Ellipsoid {
  std::array<double, 3> length{};         ///< full lengths a >= b >= c [m]
  std::array<Vec3d, 3> axis{};            ///< unit vectors along them
  std::array<double, 3> moment{};         ///< of inertia about these axes, smallest first [kg m2]
  double b_over_a = 0.0, c_over_a = 0.0;  ///< 0 where they mean nothing: see equivalent_ellipsoid
};

/// a = sqrt(10 (I1 + I2 - I3)/M) and so on with the principal moments I1 >= I2 >= I3 (physics.md 7), computed from the
/// eigenvalues of `second_moment` = sum m x x^T about the centre of mass [kg m2], whose differences do not cancel.
/// Fewer than four particles and lines get both ratios 0, plates c/a = 0.
Ellipsoid equivalent_ellipsoid(const Sym3<double>& second_moment, double mass, std::uint64_t particles);

enum class ShapeClass { kSpherical, kBilobed, kElongated, kFlat, kHemispherical, kSuperCatastrophic };

/// "spherical", "bilobed", "elongated", "flat", "hemispherical" or "super-catastrophic".
const char* class_name(ShapeClass shape);

/// The class of a largest remnant, in the order of physics.md 7. A remnant of at least `whole` target masses counts as
/// both bodies in one.
ShapeClass classify(double mass_over_target, double b_over_a, double c_over_a, double whole = 1.99);

}  // namespace breccia::analysis

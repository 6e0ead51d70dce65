#include "scene/shapes.hpp"

#include <algorithm>
#include <cmath>

#include "breccia/constants.hpp"

namespace breccia::scene {

double shape_volume(Shape shape, const Vec3d& semi_axes) {
  const double product = semi_axes.x * semi_axes.y * semi_axes.z;
  if (shape == Shape::kBox) return 8.0 * product;
  if (shape == Shape::kCylinder) return 2.0 * kPi * product;
  return 4.0 / 3.0 * kPi * product;
}

double scaled_radius(Shape shape, const Vec3d& semi_axes, const Vec3d& x) {
  const Vec3d u{x.x / semi_axes.x, x.y / semi_axes.y, x.z / semi_axes.z};
  if (shape == Shape::kBox) return std::max({std::abs(u.x), std::abs(u.y), std::abs(u.z)});
  if (shape == Shape::kCylinder) return std::max(std::sqrt(u.x * u.x + u.y * u.y), std::abs(u.z));
  return std::sqrt(dot(u, u));
}

Vec3d second_moments(Shape shape, const Vec3d& semi_axes) {
  const Vec3d squares{semi_axes.x * semi_axes.x, semi_axes.y * semi_axes.y, semi_axes.z * semi_axes.z};
  if (shape == Shape::kBox) return (1.0 / 3.0) * squares;
  if (shape == Shape::kCylinder) return {squares.x / 4.0, squares.y / 4.0, squares.z / 3.0};
  return 0.2 * squares;
}

double support(Shape shape, const Vec3d& semi_axes, const Vec3d& normal) {
  const Vec3d reach{std::abs(normal.x) * semi_axes.x, std::abs(normal.y) * semi_axes.y,
                    std::abs(normal.z) * semi_axes.z};
  if (shape == Shape::kBox || shape == Shape::kParticles) return reach.x + reach.y + reach.z;
  if (shape == Shape::kCylinder) return std::sqrt(reach.x * reach.x + reach.y * reach.y) + reach.z;
  return std::sqrt(dot(reach, reach));
}

}  // namespace breccia::scene

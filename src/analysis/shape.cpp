#include "analysis/shape.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace breccia::analysis {
namespace {

// Second moments below this part of the largest are rounding of the sums: lengths below 1e-6 of a.
constexpr double kFlatMoment = 1e-12;

// Every group of fewer is a plate or less.
constexpr std::uint64_t kFewestForAShape = 4;

}  // namespace

Ellipsoid equivalent_ellipsoid(const Sym3<double>& second_moment, double mass, std::uint64_t particles) {
  const Sym3<double>& s = second_moment;
  Eigen::Matrix3d matrix;
  matrix << s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);

  Ellipsoid ellipsoid;
  std::array<double, 3> moment{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto column = static_cast<Eigen::Index>(2 - k);  // Eigen sorts upwards
    moment[k] = std::max(solver.eigenvalues()[column], 0.0);
    if (moment[k] <= kFlatMoment * moment[0]) moment[k] = 0.0;
    const Eigen::Vector3d v = solver.eigenvectors().col(column);
    ellipsoid.axis[k] = {v.x(), v.y(), v.z()};
    ellipsoid.length[k] = mass > 0.0 ? std::sqrt(20.0 * moment[k] / mass) : 0.0;
  }
  ellipsoid.moment = {moment[1] + moment[2], moment[0] + moment[2], moment[0] + moment[1]};
  if (particles >= kFewestForAShape && moment[1] > 0.0) {
    ellipsoid.b_over_a = ellipsoid.length[1] / ellipsoid.length[0];
    ellipsoid.c_over_a = ellipsoid.length[2] / ellipsoid.length[0];
  }
  return ellipsoid;
}

const char* class_name(ShapeClass shape) {
  switch (shape) {
    case ShapeClass::kSpherical:
      return "spherical";
    case ShapeClass::kBilobed:
      return "bilobed";
    case ShapeClass::kElongated:
      return "elongated";
    case ShapeClass::kFlat:
      return "flat";
    case ShapeClass::kHemispherical:
      return "hemispherical";
    case ShapeClass::kSuperCatastrophic:
      break;
  }
  return "super-catastrophic";
}

ShapeClass classify(double mass_over_target, double b_over_a, double c_over_a, double whole) {
  if (mass_over_target < 0.4) return ShapeClass::kSuperCatastrophic;
  if (b_over_a > 0.7 && c_over_a > 0.7) return ShapeClass::kSpherical;
  if (b_over_a <= 0.7) return mass_over_target >= whole ? ShapeClass::kBilobed : ShapeClass::kElongated;
  return mass_over_target > 1.0 ? ShapeClass::kFlat : ShapeClass::kHemispherical;
}

}  // namespace breccia::analysis

// Principal axes of points whose ellipsoid is known, and the classes of the paper.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "analysis/shape.hpp"

namespace breccia::analysis {
namespace {

Sym3<double> second_moment(const std::vector<Vec3d>& points) {
  Sym3<double> s{};
  for (const Vec3d p : points) s = s + Sym3<double>{p.x * p.x, p.y * p.y, p.z * p.z, p.x * p.y, p.x * p.z, p.y * p.z};
  return s;
}

// Rotation by an angle about (1, 1, 1), a direction in which nothing is aligned with the axes.
Vec3d turned(Vec3d p, double angle = 0.7) {
  const double third = 1.0 / 3.0;
  const double c = std::cos(angle);
  const double s = std::sin(angle) / std::sqrt(3.0);
  const double along = third * (p.x + p.y + p.z) * (1.0 - c);
  return Vec3d{along, along, along} + c * p + s * cross(Vec3d{1, 1, 1}, p);
}

Ellipsoid of(const std::vector<Vec3d>& points) {
  std::vector<Vec3d> centred = points;
  Vec3d centre{};
  for (const Vec3d p : points) centre += (1.0 / static_cast<double>(points.size())) * p;
  for (Vec3d& p : centred) p -= centre;
  return equivalent_ellipsoid(second_moment(centred), static_cast<double>(points.size()), points.size());
}

TEST(Ellipsoid, FilledEllipsoidHasItsOwnAxes) {
  std::vector<Vec3d> points;
  for (int i = -30; i <= 30; ++i) {
    for (int j = -30; j <= 30; ++j) {
      for (int k = -30; k <= 30; ++k) {
        if (i * i + j * j + k * k < 30 * 30) points.push_back(turned({100e3 * i / 30, 40e3 * j / 30, 20e3 * k / 30}));
      }
    }
  }
  const Ellipsoid e = of(points);
  // A ball of lattice points of radius 30 spacings differs from the solid one by its ragged surface: below 1 %.
  EXPECT_NEAR(e.length[0], 200e3, 2e3);
  EXPECT_NEAR(e.length[1], 80e3, 0.8e3);
  EXPECT_NEAR(e.length[2], 40e3, 0.4e3);
  EXPECT_NEAR(e.b_over_a, 0.4, 0.004);
  EXPECT_NEAR(e.c_over_a, 0.2, 0.002);
  EXPECT_NEAR(std::abs(dot(e.axis[0], turned({1, 0, 0}))), 1.0, 1e-9);
  EXPECT_NEAR(std::abs(dot(e.axis[2], turned({0, 0, 1}))), 1.0, 1e-9);
  // Inverse of the formula of physics.md 7: I3 = M (b^2 + c^2)/20.
  const double mass = static_cast<double>(points.size());
  EXPECT_NEAR(e.moment[0], mass * (e.length[1] * e.length[1] + e.length[2] * e.length[2]) / 20.0, 1e-9 * e.moment[0]);
}

// physics.md 8, case 25.
TEST(Ellipsoid, DegenerateGroupsHaveNoRatios) {
  const Vec3d a{1e3, 2e3, 3e3};
  const Vec3d b{-4e3, 1e3, 0};
  const Vec3d c{0, 5e3, -2e3};
  for (const auto& points : {std::vector<Vec3d>{a}, {a, b}, {a, b, c}, {a, a, a, a}}) {
    const Ellipsoid e = of(points);
    EXPECT_EQ(e.b_over_a, 0.0);
    EXPECT_EQ(e.c_over_a, 0.0);
    for (const double length : e.length) EXPECT_TRUE(std::isfinite(length));
  }
  EXPECT_EQ(of({a}).length[0], 0.0);
  // Two points a distance d apart: lambda = d^2/4, a = sqrt(20) d/2.
  EXPECT_NEAR(of({a, b}).length[0], std::sqrt(5.0 * dot(a - b, a - b)), 1e-6);
}

TEST(Ellipsoid, LineAndPlate) {
  std::vector<Vec3d> line;
  std::vector<Vec3d> plate;
  for (int i = 0; i < 100; ++i) {
    line.push_back(turned({100.0 * i, 0, 0}));
    for (int j = 0; j < 90; ++j) plate.push_back(turned({100.0 * i, 100.0 * j, 0}));
  }
  EXPECT_EQ(of(line).b_over_a, 0.0);
  EXPECT_EQ(of(line).c_over_a, 0.0);
  EXPECT_EQ(of(plate).c_over_a, 0.0);
  EXPECT_NEAR(of(plate).b_over_a, 0.9, 1e-3);
  // Turned otherwise, the smallest eigenvalues are roundings of either sign.
  for (int n = 0; n < 50; ++n) {
    std::vector<Vec3d> small;
    for (int i = 0; i < 36; ++i) small.push_back(turned({100.0 * (i % 6), 100.0 * (i / 6), 0}, 0.1 + 0.06 * n));
    EXPECT_EQ(of(small).c_over_a, 0.0) << n;
  }
}

TEST(Classify, FollowsTheOrderOfThePaper) {
  EXPECT_EQ(classify(0.39, 0.9, 0.9), ShapeClass::kSuperCatastrophic);
  EXPECT_EQ(classify(0.41, 0.9, 0.8), ShapeClass::kSpherical);
  EXPECT_EQ(classify(1.995, 0.5, 0.5), ShapeClass::kBilobed);
  EXPECT_EQ(classify(1.97, 0.23, 0.1), ShapeClass::kElongated);
  EXPECT_EQ(classify(1.3, 0.9, 0.5), ShapeClass::kFlat);
  EXPECT_EQ(classify(0.9, 0.9, 0.5), ShapeClass::kHemispherical);
  // The flagship run of the paper has M = 1.96 to 1.98.
  EXPECT_EQ(classify(1.97, 0.23, 0.1, 1.95), ShapeClass::kBilobed);
  EXPECT_STREQ(class_name(ShapeClass::kSuperCatastrophic), "super-catastrophic");
  EXPECT_STREQ(class_name(ShapeClass::kBilobed), "bilobed");
}

}  // namespace
}  // namespace breccia::analysis

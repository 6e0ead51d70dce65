// Cells seen from outside and local expansions against sums over their particles.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "gravity/tree/multipole.hpp"
#include "plain_sum.hpp"

namespace breccia::gravity {
namespace {

constexpr double kSoftening = 0.3;

double g(Vec3d x) { return 1.0 / std::sqrt(dot(x, x) + kSoftening * kSoftening); }

struct Source {
  std::vector<Vec3d> position;
  std::vector<double> mass;
  Moments<double> moments;
};

// Two masses whose octupole vanishes by symmetry, so that the next term is the hexadecapole.
Source symmetric_source(double size) {
  Source s;
  s.position = {size * Vec3d{0.6, -0.2, 0.3}, size * Vec3d{-0.6, 0.2, -0.3}};
  s.mass = {0.5, 0.5};
  const Vec3d d = s.position[0];
  s.moments = {1.0, {d.x * d.x, d.y * d.y, d.z * d.z, d.x * d.y, d.x * d.z, d.y * d.z}};
  return s;
}

PointField<double> exact_field(const Source& s, Vec3d at) {
  PointField<double> field{};
  for (std::size_t k = 0; k < s.mass.size(); ++k) {
    const Vec3d x = at - s.position[k];
    const double q = g(x);
    field.value += s.mass[k] * q;
    field.gradient -= s.mass[k] * q * q * q * x;
  }
  return field;
}

double distance(Vec3d a, Vec3d b) { return std::sqrt(dot(a - b, a - b)); }

TEST(Multipole, QuadrupoleLeavesTheFourthOrder) {
  const Vec3d at{3.0, 1.0, -2.0};
  double previous = 0.0;
  for (const double size : {0.4, 0.2, 0.1}) {
    const Source s = symmetric_source(size);
    const PointField<double> field = field_of(s.moments, at, g(at));
    const double error = distance(field.gradient, exact_field(s, at).gradient);
    if (previous > 0.0) {
      EXPECT_NEAR(std::log2(previous / error), 4.0, 0.2);
    }
    EXPECT_NEAR(field.value, exact_field(s, at).value, 0.1 * std::pow(size / 3.7, 4));
    previous = error;
  }
}

// Shrinking source and target together by two reduces the error of the acceleration by 2^4: nothing of the fourth
// total order is missing.
TEST(Multipole, LocalExpansionLeavesTheFourthOrderOfTheAcceleration) {
  const Vec3d centre{3.0, 1.0, -2.0};
  double previous = 0.0;
  for (const double size : {0.4, 0.2, 0.1, 0.05}) {
    const Source s = symmetric_source(size);
    LocalExpansion<double> l{};
    add_field_of(s.moments, centre, g(centre), l);
    const Vec3d r = size * Vec3d{0.5, 0.7, -0.4};
    const PointField<double> exact = exact_field(s, centre + r);
    const PointField<double> field = evaluate(l, r);
    const double error = distance(field.gradient, exact.gradient);
    if (previous > 0.0) {
      EXPECT_NEAR(std::log2(previous / error), 4.0, 0.3);
    }
    EXPECT_NEAR(field.value, exact.value, 5.0 * std::pow(size / 3.7, 5));
    previous = error;
  }
}

TEST(Multipole, CoefficientsAreDerivativesOfEachOther) {
  const Source s = symmetric_source(0.5);
  const Vec3d centre{1.5, 1.0, -2.0};
  LocalExpansion<double> l{};
  add_field_of(s.moments, centre, g(centre), l);
  // The gradient at r must be the finite difference of the value, for every coefficient at once.
  const Vec3d r{0.3, -0.2, 0.4};
  const double h = 1e-5;
  const auto value = [&](Vec3d at) { return evaluate(l, at).value; };
  const Vec3d gradient = evaluate(l, r).gradient;
  EXPECT_NEAR(gradient.x, (value(r + Vec3d{h, 0, 0}) - value(r - Vec3d{h, 0, 0})) / (2 * h), 1e-9);
  EXPECT_NEAR(gradient.y, (value(r + Vec3d{0, h, 0}) - value(r - Vec3d{0, h, 0})) / (2 * h), 1e-9);
  EXPECT_NEAR(gradient.z, (value(r + Vec3d{0, 0, h}) - value(r - Vec3d{0, 0, h})) / (2 * h), 1e-9);
}

TEST(Multipole, ShiftedExpansionIsTheSamePolynomial) {
  const Source s = symmetric_source(0.5);
  const Vec3d centre{3.0, 1.0, -2.0};
  LocalExpansion<double> l{};
  add_field_of(s.moments, centre, g(centre), l);
  const Vec3d r{0.3, -0.2, 0.4};
  const Vec3d move{-0.5, 0.1, 0.2};
  const PointField<double> a = evaluate(l, move + r);
  const PointField<double> b = evaluate(shifted(l, move), r);
  EXPECT_NEAR(a.value, b.value, 1e-15);
  EXPECT_LT(distance(a.gradient, b.gradient), 1e-15);
}

}  // namespace
}  // namespace breccia::gravity

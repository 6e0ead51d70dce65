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

// gravity.md 6.9: each coefficient is the derivative of the one before, along each axis, which differences of fourth
// order find to 1e-10. Third and fourth derivatives are those of the monopole alone.
TEST(Multipole, CoefficientsAreTheExactDerivatives) {
  const Vec3d centre{1.5, 1.0, -2.0};
  for (const bool with_shape : {true, false}) {
    Source s = symmetric_source(0.5);
    if (!with_shape) s.moments.second = {};
    const auto at = [&](Vec3d x) {
      LocalExpansion<double> l{};
      add_field_of(s.moments, x, g(x), l);
      return l;
    };
    const LocalExpansion<double> here = at(centre);
    const double h = 2e-3;
    const auto derivative = [&](Vec3d along, auto coefficient) {
      const auto difference = [&](double step) {
        return coefficient(at(centre + step * along)) - coefficient(at(centre - step * along));
      };
      return (8.0 * difference(h) - difference(2.0 * h)) / (12.0 * h);
    };
    using Expansion = LocalExpansion<double>;
    const Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    const double tolerance = 1e-9;
    EXPECT_NEAR(derivative(x, [](const Expansion& l) { return l.value; }), here.d1.x, tolerance);
    EXPECT_NEAR(derivative(z, [](const Expansion& l) { return l.value; }), here.d1.z, tolerance);
    EXPECT_NEAR(derivative(x, [](const Expansion& l) { return l.d1.x; }), here.d2.xx, tolerance);
    EXPECT_NEAR(derivative(y, [](const Expansion& l) { return l.d1.x; }), here.d2.xy, tolerance);
    EXPECT_NEAR(derivative(z, [](const Expansion& l) { return l.d1.y; }), here.d2.yz, tolerance);
    if (with_shape) continue;
    EXPECT_NEAR(derivative(x, [](const Expansion& l) { return l.d2.xx; }), here.d3.xxx, tolerance);
    EXPECT_NEAR(derivative(y, [](const Expansion& l) { return l.d2.xx; }), here.d3.xxy, tolerance);
    EXPECT_NEAR(derivative(z, [](const Expansion& l) { return l.d2.xy; }), here.d3.xyz, tolerance);
    EXPECT_NEAR(derivative(y, [](const Expansion& l) { return l.d2.zz; }), here.d3.yzz, tolerance);
    EXPECT_NEAR(derivative(z, [](const Expansion& l) { return l.d2.zz; }), here.d3.zzz, tolerance);
    EXPECT_NEAR(derivative(x, [](const Expansion& l) { return l.d3.xxx; }), here.d4.xxxx, tolerance);
    EXPECT_NEAR(derivative(y, [](const Expansion& l) { return l.d3.xxy; }), here.d4.xxyy, tolerance);
    EXPECT_NEAR(derivative(z, [](const Expansion& l) { return l.d3.xxy; }), here.d4.xxyz, tolerance);
    EXPECT_NEAR(derivative(x, [](const Expansion& l) { return l.d3.yzz; }), here.d4.xyzz, tolerance);
    EXPECT_NEAR(derivative(z, [](const Expansion& l) { return l.d3.yyz; }), here.d4.yyzz, tolerance);
    EXPECT_NEAR(derivative(z, [](const Expansion& l) { return l.d3.zzz; }), here.d4.zzzz, tolerance);
  }
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

// Even filling of shapes with an exact number of points.
#include "scene/lattice.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "scene/shapes.hpp"

namespace breccia::scene {
namespace {

const std::vector<Lattice> kLattices{Lattice::kFcc, Lattice::kHcp, Lattice::kCubic, Lattice::kRandom};

std::vector<Vec3d> fill(Lattice lattice, Shape shape, const Vec3d& semi_axes, std::uint64_t n) {
  return LatticeFill(lattice, shape, semi_axes, n, RandomStream(1, 7)).points(0, n);
}

struct Moments {
  Vec3d mean{};
  Sym3<double> second{};
};

Moments moments(const std::vector<Vec3d>& points) {
  Moments m;
  const double w = 1.0 / static_cast<double>(points.size());
  for (const Vec3d& x : points) {
    m.mean += w * x;
    m.second = m.second + w * Sym3<double>{x.x * x.x, x.y * x.y, x.z * x.z, x.x * x.y, x.x * x.z, x.y * x.z};
  }
  return m;
}

double nearest_distance(const std::vector<Vec3d>& points, std::size_t i) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < points.size(); ++j) {
    const Vec3d d = points[j] - points[i];
    if (j != i) best = std::min(best, dot(d, d));
  }
  return std::sqrt(best);
}

// A lattice of N points cut by a sphere has about N^(1/3) random surface errors per N^(2/3) surface points, a few 1e-3
// of the second moment at N = 3000; choosing the origin brings it below.
TEST(Lattice, SpheresAreFilledEvenly) {
  const double r = 5.0e4;
  for (const Lattice lattice : kLattices) {
    for (const std::uint64_t n : {3000U, 3004U, 20000U, 47324U}) {
      SCOPED_TRACE(testing::Message() << "lattice " << static_cast<int>(lattice) << ", n = " << n);
      const auto points = fill(lattice, Shape::kSphere, {r, r, r}, n);
      ASSERT_EQ(points.size(), n);
      const Moments m = moments(points);
      const double inertia = (m.second.xx + m.second.yy + m.second.zz) * 2.0 / 3.0;  // mean of I/M over directions
      EXPECT_NEAR(inertia / (0.4 * r * r), 1.0, 5e-3);
      for (const double axis : {m.second.xx, m.second.yy, m.second.zz}) EXPECT_NEAR(axis / (0.2 * r * r), 1.0, 5e-3);
      for (const double mixed : {m.second.xy, m.second.xz, m.second.yz}) EXPECT_NEAR(mixed / (0.2 * r * r), 0.0, 5e-3);
      // Exactly in the centre: rounding of n additions.
      EXPECT_NEAR(std::sqrt(dot(m.mean, m.mean)) / r, 0.0, 1e-12);
      // No point farther out than a small part of the spacing (4 R/100 at n = 47324).
      for (const Vec3d& x : points) ASSERT_LT(std::sqrt(dot(x, x)), 1.02 * r);
    }
  }
}

// Nested spheres of equal volume hold equal numbers: the density is uniform in radius. Points of a lattice that is
// symmetric about the centre cross the surface of a shell in families of up to 48, so three families, 144, of 2500.
TEST(Lattice, DensityIsUniform) {
  for (const Lattice lattice : kLattices) {
    const auto points = fill(lattice, Shape::kSphere, {1, 1, 1}, 20000);
    std::vector<int> shells(8);
    for (const Vec3d& x : points) {
      const double volume = std::pow(dot(x, x), 1.5);
      ++shells[std::min<std::size_t>(7, static_cast<std::size_t>(8.0 * volume))];
    }
    for (const int count : shells) EXPECT_NEAR(count, 2500, 144);
  }
}

// The distance of neighbours is that of the perfect lattice whose points own V/N each.
TEST(Lattice, NeighboursAreOneSpacingApart) {
  const double r = 5.0e4;
  const std::uint64_t n = 3004;
  const double volume = shape_volume(Shape::kSphere, {r, r, r}) / static_cast<double>(n);
  for (const Lattice lattice : {Lattice::kFcc, Lattice::kHcp, Lattice::kCubic}) {
    const auto points = fill(lattice, Shape::kSphere, {r, r, r}, n);
    const double spacing = lattice_spacing(lattice, volume);
    for (std::size_t i = 0; i < n; i += 97) EXPECT_NEAR(nearest_distance(points, i) / spacing, 1.0, 1e-9);
  }
  EXPECT_DOUBLE_EQ(lattice_spacing(Lattice::kFcc, volume_per_particle(Lattice::kFcc, 2500.0)), 2500.0);
  // fcc with neighbours one cell apart has sqrt(2) particles per cell (physics.md 6).
  EXPECT_NEAR(1.0 / volume_per_particle(Lattice::kFcc, 1.0), std::numbers::sqrt2, 1e-15);
  EXPECT_DOUBLE_EQ(volume_per_particle(Lattice::kHcp, 3.0), volume_per_particle(Lattice::kFcc, 3.0));
}

TEST(Lattice, EllipsoidsCylindersAndBoxes) {
  const Vec3d axes{3.0, 2.0, 1.0};
  const Moments e = moments(fill(Lattice::kHcp, Shape::kEllipsoid, axes, 10000));
  const Vec3d want = second_moments(Shape::kEllipsoid, axes);
  EXPECT_NEAR(e.second.xx / want.x, 1.0, 5e-3);
  EXPECT_NEAR(e.second.yy / want.y, 1.0, 5e-3);
  EXPECT_NEAR(e.second.zz / want.z, 1.0, 5e-3);

  // Flat faces: the moments of a lattice miss those of the body by the moment of one cell, spacing^2/12 per axis, and
  // by the planes that do not fit.
  const Vec3d cylinder{1.0, 1.0, 0.5};
  const auto column = fill(Lattice::kCubic, Shape::kCylinder, cylinder, 25133);
  ASSERT_EQ(column.size(), 25133U);
  const Moments c = moments(column);
  EXPECT_NEAR(c.second.xx / 0.25, 1.0, 0.01);
  EXPECT_NEAR(c.second.zz / (0.25 / 3.0), 1.0, 0.01);
  for (const Vec3d& x : column) ASSERT_LT(scaled_radius(Shape::kCylinder, cylinder, x), 1.0 + 0.5 * 0.05);
}

// A count that fits the box gives the regular arrangement: 80 x 16 x 16 points, half a spacing from every face.
TEST(Lattice, CommensurateBoxIsRegular) {
  const Vec3d half{0.5, 0.1, 0.1};
  const auto points = fill(Lattice::kCubic, Shape::kBox, half, 80 * 16 * 16);
  const double a = 1.0 / 80.0;
  for (const Vec3d& x : points) {
    for (const auto& [value, limit] : {std::pair{x.x, 0.5}, std::pair{x.y, 0.1}, std::pair{x.z, 0.1}}) {
      const double planes = (value + limit) / a - 0.5;
      ASSERT_NEAR(planes, std::round(planes), 1e-9);
      ASSERT_LT(std::abs(value), limit);
    }
  }
}

TEST(Lattice, AnyCountIsExact) {
  for (const Lattice lattice : kLattices)
    for (const Shape shape : {Shape::kSphere, Shape::kEllipsoid, Shape::kBox, Shape::kCylinder})
      for (const std::uint64_t n : {1U, 2U, 3U, 7U, 13U, 64U, 1001U}) {
        const auto points = fill(lattice, shape, {4.0, 1.0, 1.5}, n);
        ASSERT_EQ(points.size(), n);
        for (std::size_t i = 0; n < 100 && n > 1 && i < n; ++i) ASSERT_GT(nearest_distance(points, i), 1e-3);
      }
}

TEST(Lattice, SharesAreSlicesOfTheWhole) {
  for (const Lattice lattice : kLattices) {
    const LatticeFill body(lattice, Shape::kSphere, {1, 1, 1}, 5000, RandomStream(3, 1));
    const auto all = body.points(0, 5000);
    std::vector<Vec3d> joined;
    for (const auto& [begin, end] : {std::pair{0, 1}, std::pair{1, 1777}, std::pair{1777, 1777}, std::pair{1777, 5000}})
      for (const Vec3d& x : body.points(static_cast<std::uint64_t>(begin), static_cast<std::uint64_t>(end)))
        joined.push_back(x);
    ASSERT_EQ(joined.size(), all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      ASSERT_EQ(joined[i].x, all[i].x);
      ASSERT_EQ(joined[i].y, all[i].y);
      ASSERT_EQ(joined[i].z, all[i].z);
    }
  }
}

TEST(Lattice, RandomDependsOnTheSeedOnly) {
  const auto make = [](std::uint64_t seed) {
    return LatticeFill(Lattice::kRandom, Shape::kSphere, {1, 1, 1}, 500, RandomStream(seed, 0)).points(0, 500);
  };
  EXPECT_EQ(make(1)[17].x, make(1)[17].x);
  EXPECT_NE(make(1)[17].x, make(2)[17].x);
}

}  // namespace
}  // namespace breccia::scene

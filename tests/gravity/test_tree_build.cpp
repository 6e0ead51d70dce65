// The tree itself: every particle once, moments and radii right, splits bounded.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "deal_out.hpp"
#include "gravity/tree/scales.hpp"
#include "gravity/tree/tree.hpp"
#include "gravity/tree/walk.hpp"

namespace breccia::gravity {
namespace {

Tree built(const Cloud& cloud, int threads = 1) {
  Tree tree;
  const Vec3d far{1e6, 1e6, 1e6};
  tree.sort(random_root(-far, far), {cloud.position, cloud.mass}, 1e13, threads);
  tree.build(threads);
  return tree;
}

TEST(RadixSort, SortsAndKeepsTheOrderOfEqualKeys) {
  std::mt19937_64 random(1);
  std::vector<KeyedIndex> items(100'000), scratch;
  for (std::size_t i = 0; i < items.size(); ++i) {
    items[i] = {(random() >> 1) & (i % 3 == 0 ? 0xffULL : ~0ULL), static_cast<std::int64_t>(i)};
  }
  auto expected = items;
  std::stable_sort(expected.begin(), expected.end(), [](auto a, auto b) { return a.key < b.key; });
  for (const int threads : {1, 3}) {
    auto sorted = items;
    radix_sort(sorted, scratch, threads);
    for (std::size_t i = 0; i < items.size(); ++i) ASSERT_EQ(sorted[i].index, expected[i].index);
  }
}

TEST(Morton, NeighbouringCellsDifferInTheLastBits) {
  EXPECT_EQ(morton_key({0, 0, 0}, 1.0), 0U);
  EXPECT_EQ(morton_key({0, 0, 1}, 1.0), 1U);
  EXPECT_EQ(morton_key({0, 1, 0}, 1.0), 2U);
  EXPECT_EQ(morton_key({1, 0, 0}, 1.0), 4U);
  EXPECT_EQ(morton_key({-5, 1e9, 1e9}, 1.0), 0x3fffffffffffffffULL & (0x1249249249249249ULL * 3));
}

TEST(Tree, ChildrenDivideTheirParentsParticles) {
  const Cloud cloud = two_spheres(5000);
  const Tree tree = built(cloud);
  ASSERT_EQ(tree.cell(0).count, 5000);
  for (const Cell& cell : tree.cells) {
    EXPECT_EQ(cell.count, cell.end - cell.begin);
    if (cell.is_leaf()) {
      EXPECT_LE(cell.count, kLeafParticles);
      continue;
    }
    ASSERT_GE(cell.children, 2);
    ASSERT_LE(cell.children, 8);
    std::int32_t at = cell.begin;
    for (const Cell& child : tree.children(cell)) {
      EXPECT_EQ(child.begin, at);
      at = child.end;
    }
    EXPECT_EQ(at, cell.end);
  }
}

TEST(Tree, MomentsAndRadiusAreThoseOfTheParticles) {
  const Tree tree = built(two_spheres(3000));
  for (const Cell& cell : tree.cells) {
    double mass = 0.0;
    Vec3d first{};
    double xx = 0.0, yz = 0.0, farthest = 0.0;
    for (std::int64_t i = cell.begin; i < cell.end; ++i) {
      const double m = tree.particles.mass[static_cast<std::size_t>(i)];
      const Vec3d d = tree.particles.position(i) - cell.centre;
      mass += m;
      first += m * d;
      xx += m * d.x * d.x;
      yz += m * d.y * d.z;
      farthest = std::max(farthest, std::sqrt(dot(d, d)));
    }
    const double size = std::max(cell.radius, 1e-3);
    EXPECT_NEAR(cell.moments.mass / mass, 1.0, 1e-13);
    // Coordinates are of the order of a thousand units, rounded at 1e-13.
    EXPECT_LT(std::sqrt(dot(first, first)), 1e-11 * mass);
    EXPECT_NEAR(cell.moments.second.xx, xx, 1e-11 * mass * size * size);
    EXPECT_NEAR(cell.moments.second.yz, yz, 1e-11 * mass * size * size);
    EXPECT_LE(farthest, cell.radius * (1 + 1e-12));
    EXPECT_LE(cell.radius, farthest * (1 + 1e-9) + 1e-9) << "loose bounds open too many cells";
  }
}

// Half to all of the limit wherever the root lies: what a plain octree would leave to chance.
TEST(Tree, GroupsAreAtLeastAThirdFullOnAverage) {
  Cloud cloud;
  std::mt19937_64 random(2);
  for (const double side : {3e5, 4e5, 5e5}) {
    cloud = {};
    add_ball(cloud, 20'000, {}, side, random);
    const Tree tree = built(cloud);
    const auto groups = tree.groups();
    EXPECT_GT(20'000.0 / static_cast<double>(groups.size()), static_cast<double>(kGroupParticles) / 3.0);
    std::int32_t at = 0;
    for (const std::int32_t g : groups) {
      EXPECT_EQ(tree.cell(g).begin, at);
      at = tree.cell(g).end;
    }
    EXPECT_EQ(at, 20'000);
  }
}

Cloud part(const Cloud& cloud, std::size_t begin, std::size_t end) {
  const auto slice = [&](const auto& v) {
    return std::remove_cvref_t<decltype(v)>(v.begin() + static_cast<std::ptrdiff_t>(begin),
                                            v.begin() + static_cast<std::ptrdiff_t>(end));
  };
  return {slice(cloud.position), slice(cloud.mass)};
}

// One rule for sets (gravity.md 5.2): the field of a whole is the sum over pairs of sets, each with its own tree.
TEST(Walk, SetsWithTreesOfTheirOwnAddUp) {
  const std::size_t n = 3000;
  const Cloud cloud = two_spheres(n);
  const Tree first = built(part(cloud, 0, n / 3));
  const Tree second = built(part(cloud, n / 3, n));
  const Vec3d far{1e6, 1e6, 1e6};
  const double unit = random_root(-far, far).unit;
  const WalkSettings settings{.tolerance = 2e-4, .softening = 125.0 / unit, .threads = 1};
  FieldSums sums;
  sums.reset(first.particles.size(), true);
  const std::vector<double> scales = acceleration_scales(first, {}, settings.softening, 1);
  for (const Tree* sources : {&first, &second}) walk<float>(first, scales, *sources, settings, sums);

  const Field plain = plain_sum(cloud, 125.0);
  std::vector<Vec3d> a(n / 3), exact(n / 3);
  double worst = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    const auto i = static_cast<std::size_t>(first.particles.order[k]);
    const double g = kGravitationalConstant * 1e13 / (unit * unit);
    a[k] = g * Vec3d{sums.acceleration[0][k], sums.acceleration[1][k], sums.acceleration[2][k]};
    exact[k] = plain.acceleration[i];
    worst =
        std::max(worst, std::abs(kGravitationalConstant * 1e13 / unit * sums.potential[k] / plain.potential[i] - 1));
  }
  EXPECT_LT(rms_error(a, exact), 3.5e-4);
  EXPECT_LT(worst, 1e-3);
}

TEST(RandomRoot, HoldsAllAndDiffersFromStateToState) {
  const Vec3d low{-1e5, 2e5, 0}, high{3e5, 2.5e5, 0};
  const Root root = random_root(low, high);
  EXPECT_LE(root.corner.x, low.x);
  EXPECT_GE(root.corner.x + root.side, high.x);
  EXPECT_LE(root.corner.z, 0.0);
  EXPECT_EQ(root.corner.y, random_root(low, high).corner.y);
  EXPECT_NE(root.corner.x, random_root(low, {3e5 + 1, 2.5e5, 0}).corner.x);
  EXPECT_EQ(std::exp2(std::round(std::log2(root.unit))), root.unit) << "a power of two loses no bits";
}

}  // namespace
}  // namespace breccia::gravity

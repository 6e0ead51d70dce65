// Friends of friends: known groups, the definition tried pair by pair, and the same labels on any number of ranks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "analysis/fof.hpp"
#include "breccia/error.hpp"

namespace breccia::analysis {
namespace {

constexpr double kLink = 7.5e3;

using Labels = std::vector<std::uint64_t>;
using Owner = std::function<int(std::size_t)>;

// The definition: every pair, spread until nothing changes.
Labels plain_groups(const std::vector<Vec3d>& position, double link) {
  Labels label(position.size());
  for (std::size_t i = 0; i < label.size(); ++i) label[i] = i;
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < label.size(); ++i) {
      for (std::size_t j = 0; j < label.size(); ++j) {
        const Vec3d d = position[i] - position[j];
        if (dot(d, d) >= link * link || label[j] >= label[i]) continue;
        label[i] = label[j];
        changed = true;
      }
    }
  }
  return label;
}

Owner round_robin() {
  return [](std::size_t i) { return static_cast<int>(i) % mpi::Comm().size(); };
}

struct Grouped {
  Labels label;  // of all particles, on all ranks
  FriendsCost cost;
};

// Deals the particles (ids 0 .. n-1) out to the ranks, groups them and collects the labels by id.
Grouped group(const std::vector<Vec3d>& position, double link, const Owner& owner) {
  const mpi::Comm comm;
  std::vector<Vec3d> mine;
  Labels id;
  for (std::size_t i = 0; i < position.size(); ++i) {
    if (owner(i) != comm.rank()) continue;
    mine.push_back(position[i]);
    id.push_back(i);
  }
  Grouped result{Labels(position.size(), 0), {}};
  const Labels label = find_groups(mine, id, link, comm, &result.cost);
  for (std::size_t k = 0; k < id.size(); ++k) result.label[id[k]] = label[k];
  comm.sum(std::span<std::uint64_t>(result.label));
  return result;
}

std::vector<Vec3d> random_points(std::size_t n, double half_side, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> along(-half_side, half_side);
  std::vector<Vec3d> points(n);
  for (Vec3d& p : points) p = {along(random), along(random), along(random)};
  return points;
}

// Around the density where groups of all sizes occur: 2.7 links of volume per 4 pi/3 friends at half side 5 links.
TEST(FriendsOfFriends, FollowsTheDefinition) {
  for (const double half_side : {3.0, 4.5, 6.0}) {
    const std::vector<Vec3d> points = random_points(600, half_side * kLink, 5);
    const Labels expected = plain_groups(points, kLink);
    EXPECT_EQ(group(points, kLink, round_robin()).label, expected);
  }
}

TEST(FriendsOfFriends, DistributionDoesNotChangeALabel) {
  const std::vector<Vec3d> points = random_points(600, 4.5 * kLink, 9);
  const Labels expected = plain_groups(points, kLink);
  const int ranks = mpi::Comm().size();
  const Owner slabs = [&](std::size_t i) {
    return std::min(ranks - 1, static_cast<int>((points[i].x / (9.0 * kLink) + 0.5) * ranks));
  };
  const Owner last = [&](std::size_t) { return ranks - 1; };
  EXPECT_EQ(group(points, kLink, slabs).label, expected);
  EXPECT_EQ(group(points, kLink, last).label, expected);
}

// The news of the smallest id has to pass through every rank again and again.
TEST(FriendsOfFriends, ChainWindsThroughAllRanks) {
  std::vector<Vec3d> chain;
  for (int k = 0; k < 400; ++k) {
    const int column = k % 20;
    const int row = k / 20;
    chain.push_back({0.9 * kLink * column, 0.0, 2.5 * kLink * row});
  }
  for (int k = 0; k < 19; ++k) {
    const double x = k % 2 == 0 ? 0.9 * kLink * 19 : 0.0;  // bridges at alternating ends
    chain.push_back({x, 0.0, 2.5 * kLink * k + 0.8 * kLink});
    chain.push_back({x, 0.0, 2.5 * kLink * k + 1.6 * kLink});
  }
  const int ranks = mpi::Comm().size();
  const Owner columns = [&](std::size_t i) {
    return std::min(ranks - 1, static_cast<int>(chain[i].x / (17.2 * kLink) * ranks));
  };
  for (const std::uint64_t label : group(chain, kLink, columns).label) EXPECT_EQ(label, 0U);
  chain[400].z -= 0.2 * kLink;  // opens the first bridge
  const Labels cut = group(chain, kLink, columns).label;
  EXPECT_EQ(cut[19], 0U);
  EXPECT_EQ(cut[20], 20U);
}

TEST(FriendsOfFriends, LinkIsStrictlyShorterThanTheLength) {
  const std::vector<Vec3d> at{{-2e7, 0, 0}, {-2e7 + kLink, 0, 0}, {2e7, 0, 0}, {2e7 + 0.999999 * kLink, 0, 0}};
  EXPECT_EQ(group(at, kLink, round_robin()).label, (Labels{0, 1, 2, 2}));
}

TEST(FriendsOfFriends, EmptyAndSingle) {
  EXPECT_TRUE(group({}, kLink, round_robin()).label.empty());
  EXPECT_EQ(group({{4e7, -4e7, 4e7}}, kLink, round_robin()).label, (Labels{0}));
}

// physics.md 8, case 24. Work is counted: a pairwise search would need 5e9 distances.
TEST(FriendsOfFriends, CrowdedCellIsLinear) {
  const std::vector<Vec3d> points = random_points(100000, 0.2 * kLink, 3);
  const Grouped result = group(points, kLink, round_robin());
  EXPECT_TRUE(std::all_of(result.label.begin(), result.label.end(), [](std::uint64_t l) { return l == 0; }));
  EXPECT_LT(result.cost.distances, 2000000U);
}

// Two crowded plates, oblique to the cells and a little more than the link apart: boxes around cells overlap in reach,
// particles never do, so every pair of cells has to be ruled out.
TEST(FriendsOfFriends, CrowdedNeighboursOutOfReachAreCheap) {
  std::vector<Vec3d> points = random_points(100000, 0.5 * kLink, 4);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double along = std::sqrt(0.5) * points[i].x;
    const double apart = i % 2 == 0 ? 0.0 : std::sqrt(0.5) * 1.05 * kLink;
    points[i] = {along + apart, apart - along, points[i].z};
  }
  const Grouped result = group(points, kLink, [](std::size_t) { return 0; });
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_EQ(result.label[i], i % 2);
  // Ten neighbours a cell, twelve halvings of each: 1e5 x 10 x 12 x 2 boxed particles; pairwise it would be 1e9.
  EXPECT_LT(result.cost.distances, 30000000U);
}

TEST(FriendsOfFriends, IsolatedParticlesAreCheap) {
  // A lattice of 1.1 links over 4e5 m: no friends, but neighbouring cells all around.
  std::vector<Vec3d> points;
  for (int k = 0; k < 100000; ++k) {
    const int node[3] = {k % 50, k / 50 % 50, k / 2500};
    points.push_back({1.1 * kLink * node[0], 1.1 * kLink * node[1], 1.1 * kLink * node[2]});
  }
  const Grouped result = group(points, kLink, [](std::size_t i) { return i < 50000 ? 0 : mpi::Comm().size() - 1; });
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_EQ(result.label[i], i);
  // Two cells away at most: 26 lattice neighbours, each pair once, with two boxes and one distance.
  EXPECT_LT(result.cost.cell_pairs, 1400000U);
  EXPECT_LT(result.cost.distances, 4200000U);
}

TEST(FriendsOfFriends, RefusesNonsense) {
  const mpi::Comm comm;
  const std::vector<Vec3d> nan{{std::numeric_limits<double>::quiet_NaN(), 0, 0}};
  const Labels id{0};
  EXPECT_THROW(static_cast<void>(find_groups(nan, id, kLink, comm)), NumericsError);
  EXPECT_THROW(static_cast<void>(find_groups({}, {}, 0.0, comm)), UsageError);
}

}  // namespace
}  // namespace breccia::analysis

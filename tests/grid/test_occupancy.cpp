// Which blocks hold particles, and which particles are alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <random>
#include <stdexcept>
#include <vector>

#include "grid/cell_counts.hpp"
#include "grid/occupancy.hpp"
#include "grid/shares.hpp"

namespace breccia::grid {
namespace {

using Node = std::array<std::int32_t, 3>;

std::vector<Node> random_nodes(std::mt19937& random, int count, std::int32_t width) {
  std::uniform_int_distribution<std::int32_t> coordinate(0, width - 1);
  std::vector<Node> nodes;
  for (int n = 0; n < count; ++n) nodes.push_back({coordinate(random), coordinate(random), coordinate(random)});
  return nodes;
}

Occupancy occupancy_of(std::span<const Node> nodes) {
  Occupancy occupancy;
  for (const Node& node : nodes) occupancy.add({node[0], node[1], node[2]});
  return occupancy;
}

BlockKey block_of(const Node& node) { return block_key({node[0] >> 2, node[1] >> 2, node[2] >> 2}); }

// Blocks apart along an axis, the shorter way round where it repeats.
std::int32_t apart(std::int32_t a, std::int32_t b, std::int32_t period) {
  const std::int32_t straight = std::abs(a - b);
  return period == 0 ? straight : std::min(straight, period - straight);
}

// By the definition, over all pairs: no particle in the same block; none in the blocks around it, unless it is one by
// itself and so far away that stencils cannot meet after either has drifted a node.
bool is_alone(std::span<const Node> nodes, std::size_t n, const Periodicity& periodicity) {
  if (std::ranges::count(periodicity.blocks, 1) > 0) return false;  // a block beside itself
  std::map<BlockKey, int> in_block;
  for (const Node& node : nodes) ++in_block[block_of(node)];
  for (std::size_t other = 0; other < nodes.size(); ++other) {
    if (other == n) continue;
    bool beside = true;
    bool within_reach = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int32_t period = periodicity.blocks[axis];
      beside = beside && apart(nodes[n][axis] >> 2, nodes[other][axis] >> 2, period) <= 1;
      within_reach = within_reach && apart(nodes[n][axis], nodes[other][axis], 4 * period) <= 4;
    }
    if (beside && (in_block[block_of(nodes[other])] > 1 || within_reach)) return false;
  }
  return true;
}

void compare(std::span<const Node> nodes, const Periodicity& periodicity, int& alone, int threads = 1) {
  Occupancy occupancy = occupancy_of(nodes);
  occupancy.count_cubes(threads);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const auto found = std::ranges::find(occupancy.blocks(), block_of(nodes[n]), &Occupant::block);
    const auto b = static_cast<std::uint32_t>(found - occupancy.blocks().begin());
    const bool expected = is_alone(nodes, n, periodicity);
    EXPECT_EQ(occupancy.is_alone(b, periodicity), expected);
    alone += expected ? 1 : 0;
  }
}

TEST(Occupancy, FindsWhoIsAloneAsThePairsSay) {
  std::mt19937 random(1);
  int alone = 0;
  int particles = 0;
  for (int round = 0; round < 30; ++round) {
    std::vector<Node> nodes = random_nodes(random, 150, 60);
    for (Node& node : nodes) node[0] -= 30;  // blocks with negative numbers, too
    compare(nodes, {}, alone, 1 + round % 3);
    particles += 150;
  }
  // Enough of either kind.
  EXPECT_GT(alone, particles / 10);
  EXPECT_LT(alone, particles * 9 / 10);
}

TEST(Occupancy, FindsItAcrossTheEndsOfAPeriod) {
  std::mt19937 random(2);
  int alone = 0;
  // Periods of which four blocks are no part, and so short that cubes at both ends are the same one.
  for (const std::int32_t period : {1, 2, 3, 4, 5, 7, 9, 16}) {
    for (int round = 0; round < 20; ++round) {
      const std::vector<Node> nodes = random_nodes(random, 2 + static_cast<int>(random() % 20), 4 * period);
      compare(nodes, {{period, period, period}}, alone, 1 + round % 8);
    }
    // Along one axis only.
    std::vector<Node> nodes = random_nodes(random, 40, 160);
    for (Node& node : nodes) node[1] %= 4 * period;
    compare(nodes, {{0, period, 0}}, alone);
  }
  EXPECT_GT(alone, 100);
}

TEST(Occupancy, HasFewerBlocksThanThreads) {
  // At the corner of a cube: all eight cubes around are looked at.
  Occupancy occupancy = occupancy_of(std::vector<Node>{{0, 0, 0}});
  occupancy.count_cubes(8);
  EXPECT_TRUE(occupancy.is_alone(0, {}));
}

TEST(Occupancy, OfSharesIsThatOfAll) {
  std::mt19937 random(3);
  const std::vector<Node> nodes = random_nodes(random, 3000, 60);
  const std::span all(nodes);
  Occupancy joined = occupancy_of(all.first(1000));
  const Occupancy other = occupancy_of(all.subspan(1000));
  const std::vector<std::uint32_t> place = joined.merge(other);
  const Occupancy whole = occupancy_of(all);
  ASSERT_EQ(joined.blocks().size(), whole.blocks().size());
  for (std::size_t b = 0; b < whole.blocks().size(); ++b) {
    EXPECT_EQ(joined.blocks()[b].block, whole.blocks()[b].block);
    EXPECT_EQ(joined.blocks()[b].count, whole.blocks()[b].count);
  }
  ASSERT_EQ(place.size(), other.blocks().size());
  for (std::size_t b = 0; b < place.size(); ++b) EXPECT_EQ(joined.blocks()[place[b]].block, other.blocks()[b].block);
}

TEST(Occupancy, KnowsOnlyWhatTheBlocksBesideKnow) {
  const auto low = [](BlockCoord b) { return b.y < 3; };
  EXPECT_TRUE(known_around({9, 1, 9}, 1, {}, low));
  EXPECT_FALSE(known_around({9, 2, 9}, 1, {}, low));
  EXPECT_FALSE(known_around({9, 0, 9}, 1, {{0, 5, 0}}, low));  // beside it lies block 4
}

TEST(CellCounts, KnowTheCellsInStorageOrder) {
  for (std::uint32_t n = 0; n < kStackCells; ++n) EXPECT_EQ(kCellsInOrder[n].index(), n);
}

TEST(Shares, CoverAllAndHandOnWhatIsThrown) {
  EXPECT_EQ(even_shares(10, 3), (std::vector<std::uint32_t>{0, 3, 6, 10}));
  EXPECT_EQ(even_shares(1, 2), (std::vector<std::uint32_t>{0, 0, 1}));
  std::vector<int> calls(5, 0);
  const auto work = [&](std::size_t n) {
    ++calls[n];
    if (n == 2) throw std::runtime_error("of share 2");
    if (n == 3) throw std::logic_error("of share 3");
  };
  EXPECT_THROW(for_each_share(3, 5, work), std::runtime_error);
  EXPECT_EQ(calls, std::vector<int>(5, 1));
}

}  // namespace
}  // namespace breccia::grid

// Where the nodes of blocks lie.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <utility>

#include "grid/node_columns.hpp"

namespace breccia::grid {
namespace {

// Blocks of random columns, runs of up to 12 with gaps between them, in random order.
std::vector<BlockKey> random_keys() {
  std::mt19937 random(1);
  const auto draw = [&](int below) { return static_cast<std::int32_t>(random() % static_cast<unsigned>(below)); };
  std::set<BlockKey> keys;
  for (int run = 0; run < 400; ++run) {
    const BlockCoord lowest{draw(12) - 6, draw(12) - 6, draw(60) - 30};
    const int count = 1 + draw(12);
    for (std::int32_t n = 0; n < count; ++n) keys.insert(block_key({lowest.x, lowest.y, lowest.z + n}));
  }
  std::vector<BlockKey> shuffled(keys.begin(), keys.end());
  std::shuffle(shuffled.begin(), shuffled.end(), random);
  return shuffled;
}

TEST(NodeColumns, GiveEachNodeItsOwnPlace) {
  const std::vector<BlockKey> keys = random_keys();
  NodeColumns columns(32);
  columns.lay_out(keys);
  columns.append_run(5);
  columns.append_run(1);
  ASSERT_EQ(columns.blocks().size(), keys.size() + 6);
  std::set<std::uint32_t> taken;
  for (const BlockPlace& block : columns.blocks()) {
    for (std::uint32_t n = 0; n < kBlockNodes; ++n) EXPECT_TRUE(taken.insert(block.node(n)).second);
  }
  // A stack may count from 18 nodes below the first place, and a load take four nodes from any.
  EXPECT_GE(*taken.begin(), 18U);
  EXPECT_LE(*taken.rbegin() + 4, columns.places());
  EXPECT_LT(columns.places(), taken.size() * 9 / 8 + 24);
}

TEST(NodeColumns, GoOnFromBlockToBlock) {
  const std::vector<BlockKey> keys = random_keys();
  NodeColumns columns(32);
  columns.lay_out(keys);
  std::size_t pairs = 0;
  for (std::size_t low = 0; low < keys.size(); ++low) {
    const BlockPlace& below = columns.blocks()[low];
    // Pairs of nodes are lines of the cache.
    EXPECT_EQ(below.first % 2, 0U);
    EXPECT_EQ(below.height % 2, 0U);
    const auto above = std::find(keys.begin(), keys.end(), keys[low] + 1);
    if (above == keys.end()) continue;
    const BlockPlace& next = columns.blocks()[static_cast<std::size_t>(above - keys.begin())];
    ++pairs;
    for (std::uint32_t x = 0; x < 4; ++x) {
      for (std::uint32_t y = 0; y < 4; ++y) EXPECT_EQ(next.node(x, y, 0), below.node(x, y, 3) + 1);
    }
  }
  EXPECT_GT(pairs, 100U);
}

// Loads would wait for stores whose addresses agree in their last twelve bits. Sums of a node are 32 bytes and
// velocities twice 16 in mixed precision, both are 64 in double.
TEST(NodeColumns, OfAStencilAreNever4096BytesApart) {
  for (int blocks = 1; blocks <= 300; ++blocks) {
    for (const int bytes : {32, 64}) {
      NodeColumns columns(static_cast<std::size_t>(bytes));
      columns.append_run(blocks);
      const auto height = static_cast<int>(columns.blocks()[0].height);
      for (int x = 0; x <= 2; ++x) {
        for (int y = -2; y <= 2; ++y) {
          const int apart = (kBlockWidth * x + y) * height;
          if (apart == 0) continue;
          EXPECT_NE(apart * bytes % 4096, 0) << blocks << " blocks";
          EXPECT_NE(apart * bytes / 2 % 4096, 0) << blocks << " blocks";
        }
      }
    }
  }
}

}  // namespace
}  // namespace breccia::grid

// Keys and the table of blocks; periodic wrapping; which tiles may run at once.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "grid/blocks.hpp"

namespace breccia::grid {
namespace {

TEST(BlockKey, RoundTripsOverTheWholeRangeAndSortsByX) {
  const std::int32_t values[] = {-kBlockLimit, -1000, -1, 0, 1, 1000, kBlockLimit};
  for (const std::int32_t x : values) {
    for (const std::int32_t y : values) {
      for (const std::int32_t z : values) EXPECT_EQ(block_coord(block_key({x, y, z})), (BlockCoord{x, y, z}));
    }
  }
  EXPECT_LT(block_key({-1, kBlockLimit, kBlockLimit}), block_key({0, -kBlockLimit, -kBlockLimit}));
}

TEST(BlockTable, FindsWhatWasInsertedAndNothingElse) {
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int32_t> coordinate(-kBlockLimit, kBlockLimit);
  std::set<BlockKey> keys;
  while (keys.size() < 20000) keys.insert(block_key({coordinate(random), coordinate(random), coordinate(random)}));
  BlockTable table;
  for (const BlockKey key : keys) table.insert(key);
  ASSERT_EQ(table.size(), keys.size());
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    EXPECT_EQ(table.find(table.keys()[i]), i);
    EXPECT_EQ(table.insert(table.keys()[i]), i);
  }
  for (int n = 0; n < 20000; ++n) {
    const BlockKey key = block_key({coordinate(random), coordinate(random), coordinate(random)});
    if (!keys.contains(key)) {
      EXPECT_EQ(table.find(key), kNoBlock);
    }
  }
  table.clear();
  EXPECT_EQ(table.find(*keys.begin()), kNoBlock);
}

TEST(Periodicity, WrapsBothWaysAndLeavesOpenAxesAlone) {
  const Periodicity periodicity{{3, 0, 5}};
  EXPECT_EQ(periodicity.wrap(BlockCoord{-1, -7, 5}), (BlockCoord{2, -7, 0}));
  EXPECT_EQ(periodicity.wrap(BlockCoord{-7, 7, 14}), (BlockCoord{2, 7, 4}));
}

}  // namespace
}  // namespace breccia::grid

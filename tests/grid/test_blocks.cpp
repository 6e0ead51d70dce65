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

TEST(BlockTable, TakesBlocksFarApartInAnyDirectionToOtherPlaces) {
  constexpr unsigned kBits = 12;
  for (const BlockCoord step : {BlockCoord{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {64, 0, 0}, {1, 1, 0}, {4, 4, 4}}) {
    std::set<std::size_t> places;
    for (std::int32_t n = -128; n < 128; ++n) {
      const std::size_t place = key_hash(block_key({n * step.x, n * step.y, n * step.z}), kBits);
      ASSERT_LT(place, std::size_t{1} << kBits);
      places.insert(place);
    }
    // 256 at random into 4096 places leave 248 of them on average.
    EXPECT_GT(places.size(), 200U) << step.x << ' ' << step.y << ' ' << step.z;
  }
}

TEST(BlockTable, HoldsMoreThanThereWasRoomFor) {
  BlockTable table;
  table.reserve(0);
  EXPECT_EQ(table.find(block_key({1, 2, 3})), kNoBlock);
  table.reserve(10);
  for (std::int32_t n = 0; n < 5000; ++n) EXPECT_EQ(table.insert(block_key({n, 0, 0})), static_cast<std::uint32_t>(n));
  table.reserve(20000);
  for (std::int32_t n = 0; n < 5000; ++n) EXPECT_EQ(table.find(block_key({n, 0, 0})), static_cast<std::uint32_t>(n));
}

TEST(Periodicity, WrapsBothWaysAndLeavesOpenAxesAlone) {
  const Periodicity periodicity{{3, 0, 5}};
  EXPECT_EQ(periodicity.wrap(BlockCoord{-1, -7, 5}), (BlockCoord{2, -7, 0}));
  EXPECT_EQ(periodicity.wrap(BlockCoord{-7, 7, 14}), (BlockCoord{2, 7, 4}));
}

}  // namespace
}  // namespace breccia::grid

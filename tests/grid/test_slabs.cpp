// Where slabs are cut: the busiest rank has the least that planes of nodes allow, for any number of ranks.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <random>
#include <set>

#include "mpi/slabs.hpp"

namespace breccia::mpi {
namespace {

std::uint64_t largest(const std::vector<std::uint64_t>& shares) { return *std::ranges::max_element(shares); }

// The least maximum over all ways to cut, found by trying them.
std::uint64_t least_maximum(const std::vector<std::uint64_t>& work, std::size_t first, int ranks) {
  if (ranks == 1)
    return std::accumulate(work.begin() + static_cast<std::ptrdiff_t>(first), work.end(), std::uint64_t{});
  std::uint64_t best = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t own = 0;
  for (std::size_t cut = first; cut <= work.size(); ++cut) {
    best = std::min(best, std::max(own, least_maximum(work, cut, ranks - 1)));
    if (cut < work.size()) own += work[cut];
  }
  return best;
}

TEST(Slabs, NoCutsLeaveLessToTheBusiestRank) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const std::size_t planes = 1 + random() % 9;
    std::vector<std::uint64_t> work(planes);
    PlaneWork all;
    for (std::size_t p = 0; p < planes; ++p) {
      work[p] = random() % 3 == 0 ? 0 : random() % 1000;
      all.nodes[static_cast<std::int32_t>(3 * p) - 7] = work[p];  // planes between them are empty
    }
    for (int ranks = 1; ranks <= 5; ++ranks) {
      const std::vector<std::uint64_t> shares = Slabs::balanced(2, all, ranks).shares(all);
      ASSERT_EQ(shares.size(), static_cast<std::size_t>(ranks));
      EXPECT_EQ(std::accumulate(shares.begin(), shares.end(), std::uint64_t{}), total(all));
      ASSERT_EQ(largest(shares), least_maximum(work, 0, ranks)) << "trial " << trial << ", ranks " << ranks;
    }
  }
}

// The work of the planes [first, last) with that of every block they are a part of.
std::uint64_t slab_work(const PlaneWork& all, std::int32_t first, std::int32_t last) {
  std::uint64_t work = 0;
  std::set<std::int32_t> blocks;
  for (std::int32_t plane = first; plane < last; ++plane) {
    work += all.nodes.at(plane);
    blocks.insert(block_of_plane(plane));
  }
  for (const std::int32_t block : blocks) work += all.blocks.at(block);
  return work;
}

std::uint64_t least_maximum(const PlaneWork& all, std::int32_t first, std::int32_t end, int ranks) {
  if (ranks == 1) return slab_work(all, first, end);
  std::uint64_t best = std::numeric_limits<std::uint64_t>::max();
  for (std::int32_t cut = first; cut <= end; ++cut) {
    best = std::min(best, std::max(slab_work(all, first, cut), least_maximum(all, cut, end, ranks - 1)));
  }
  return best;
}

// A block that a cut divides costs both sides in full: cuts run through blocks only where that is worth it.
TEST(Slabs, DividedBlocksCountOnBothSides) {
  std::mt19937_64 random(2);
  for (int trial = 0; trial < 60; ++trial) {
    const auto first = -static_cast<std::int32_t>(random() % 7);
    const auto end = first + 1 + static_cast<std::int32_t>(random() % 12);
    PlaneWork all;
    for (std::int32_t plane = first; plane < end; ++plane) {
      all.nodes[plane] = random() % 100;
      all.blocks.try_emplace(block_of_plane(plane), random() % 200);
    }
    for (int ranks = 1; ranks <= 4; ++ranks) {
      const Slabs slabs = Slabs::balanced(0, all, ranks);
      ASSERT_EQ(largest(slabs.shares(all)), least_maximum(all, first, end, ranks)) << trial << ", ranks " << ranks;
      std::int32_t begin = first;
      for (std::size_t rank = 0; rank + 1 < static_cast<std::size_t>(ranks); ++rank) {
        const std::int32_t cut = std::min(slabs.cuts()[rank], end);
        EXPECT_EQ(slabs.shares(all)[rank], slab_work(all, begin, cut));
        begin = cut;
      }
    }
  }
  // Two blocks of even planes between two ranks: cut between them. Between three, through both.
  PlaneWork two;
  for (std::int32_t plane = 0; plane < 8; ++plane) two.nodes[plane] = 10;
  two.blocks = {{0, 5}, {1, 5}};
  EXPECT_EQ(Slabs::balanced(0, two, 2).cuts(), std::vector<std::int32_t>{4});
  EXPECT_TRUE(Slabs::balanced(0, two, 2).keep_whole(kPlanesOfBlock));
  EXPECT_FALSE(Slabs::balanced(0, two, 3).keep_whole(kPlanesOfBlock));
}

// Among cuts as good, the even ones: nobody starves because another rank must have much anyway.
TEST(Slabs, OneHeavyPlaneDoesNotStarveOthers) {
  PlaneWork all{{{0, 100}}, {}};
  for (std::int32_t plane = 1; plane <= 60; ++plane) all.nodes[plane] = 1;
  const std::vector<std::uint64_t> shares = Slabs::balanced(0, all, 4).shares(all);
  EXPECT_EQ(shares[0], 100U);
  EXPECT_GE(std::min({shares[1], shares[2], shares[3]}), 5U);
}

TEST(Slabs, EveryPlaneHasOneOwnerInTheOrderOfRanks) {
  PlaneWork all;
  for (std::int32_t plane = -50; plane < 50; ++plane) all.nodes[plane] = 10;
  for (const int ranks : {1, 2, 3, 7, 64, 100, 333}) {
    const Slabs slabs = Slabs::balanced(0, all, ranks);
    int previous = 0;
    for (std::int32_t plane = -60; plane < 60; ++plane) {
      ASSERT_GE(slabs.owner(plane), previous);
      ASSERT_LT(slabs.owner(plane), ranks);
      previous = slabs.owner(plane);
    }
    // Equal planes: a hundred of them on at most a hundred ranks.
    EXPECT_EQ(largest(slabs.shares(all)), static_cast<std::uint64_t>(10 * ((100 + ranks - 1) / ranks)));
  }
}

TEST(Slabs, WithoutWork) {
  const PlaneWork nothing;
  EXPECT_EQ(Slabs::balanced(1, nothing, 5).shares(nothing), std::vector<std::uint64_t>(5, 0));
  EXPECT_EQ(extent(nothing), 0);
}

// A tenth of the work may fly as far as it wants.
TEST(Slabs, ExtentIsThatOfTheBulk) {
  PlaneWork all{{{-100000, 40}, {100000, 40}}, {}};
  for (std::int32_t plane = 10; plane < 20; ++plane) all.nodes[plane] = 100;
  EXPECT_EQ(extent(all), 10);
}

TEST(Slabs, WorkOfAllRanksOnAllRanks) {
  const Comm comm;
  const auto rank = static_cast<std::uint64_t>(comm.rank());
  const PlaneWork all = sum_over_ranks({{{comm.rank(), 5}, {1000, 1}}, {{comm.rank(), 2}, {250, rank}}}, comm);
  ASSERT_EQ(all.nodes.size(), static_cast<std::size_t>(comm.size()) + 1);
  EXPECT_EQ(all.nodes.at(comm.size() - 1), 5U);
  EXPECT_EQ(all.nodes.at(1000), static_cast<std::uint64_t>(comm.size()));
  // Parts of one plane of blocks: the largest.
  ASSERT_EQ(all.blocks.size(), static_cast<std::size_t>(comm.size()) + 1);
  EXPECT_EQ(all.blocks.at(comm.size() - 1), 2U);
  EXPECT_EQ(all.blocks.at(250), static_cast<std::uint64_t>(comm.size()) - 1);
}

}  // namespace
}  // namespace breccia::mpi

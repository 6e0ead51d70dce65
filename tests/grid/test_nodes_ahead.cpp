// Which lines of the cache are asked for ahead of a tile: those of the nodes that its particles reach and the tiles
// before it have not, in each array, once, with whatever number of packs.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "grid/nodes_ahead.hpp"

namespace breccia::grid {
namespace {

constexpr std::uint32_t kHeight = 26;  // places of a column
constexpr std::uint32_t kOfColumns = 16 * kHeight;
constexpr std::size_t kPlaces = 2 * 9 * kOfColumns;
using Lines = std::set<std::uintptr_t>;

std::uintptr_t line_of(const void* address) { return reinterpret_cast<std::uintptr_t>(address) / 64; }

// Of nine blocks' columns one after the other, from place `first` on.
Tile tile_at(std::uint32_t first, const TileBox& starts, std::uint32_t particles) {
  Tile tile;
  tile.particles = particles;
  tile.starts = starts;
  for (std::uint32_t n = 0; n < 9; ++n) tile.columns[n] = {first + n * kOfColumns, kHeight};
  return tile;
}

template <class P>
class NodesAheadOf : public testing::Test {
 protected:
  using Real = typename P::Real;

  NodesAheadOf() : sums_(kPlaces * kChannels), velocities_(kPlaces * kChannels) {
    arguments_.tiles = tiles_;
    arguments_.targets = targets_;
    arguments_.sums = sums_.data();
    arguments_.velocities = velocities_.data();
    arguments_.places = kPlaces;
  }

  // Of those that wait behind a tile of so many particles; the sums lie where the targets are.
  void set(const TileBox& starts, std::uint32_t particles) {
    tiles_[0].particles = particles;
    tiles_[1] = tile_at(0, starts, 1);
    targets_[1] = tile_at(9 * kOfColumns, starts, 1);
  }

  Lines asked() {
    NodesAhead<P> nodes(arguments_, tiles_[0], 1);
    const auto packs = static_cast<int>((tiles_[0].particles + P::kLanes - 1) / P::kLanes);
    Lines lines;
    for (int pack = 0; pack < packs; ++pack) {
      nodes.for_each_line(pack, [&](const Real* line) { lines.insert(line_of(line)); });
    }
    return lines;
  }

  // Of nodes that the tile before along y and the one below have not reached.
  Lines wanted() {
    Lines lines;
    const TileBox& starts = tiles_[1].starts;
    const auto add = [&](const Real* first, int reals) { lines.insert({line_of(first), line_of(first + reals - 1)}); };
    for (int x = starts.low[0]; x <= starts.high[0] + 2; ++x) {
      for (int y = std::max<int>(4, starts.low[1]); y <= starts.high[1] + 2; ++y) {
        for (std::size_t z = 4; z <= static_cast<std::size_t>(starts.high[2]) + 2; ++z) {
          if (arguments_.scatter) add(&sums_[(TileNodes<P>::place(targets_[1], x, y) + z) * kChannels], kChannels);
          if (!arguments_.gather) continue;
          const Real* const node = &velocities_[(TileNodes<P>::place(tiles_[1], x, y) + z) * kVelocityStride<P>];
          add(node, kVelocityStride<P>);
          if (kNodePairs<P>) add(node + rest_distance(kPlaces), kVelocityStride<P>);
        }
      }
    }
    return lines;
  }

  Tile tiles_[2], targets_[2];
  LargeArray<Real> sums_, velocities_;
  PassArguments<P> arguments_;
};

using Precisions = testing::Types<MixedPrecision, DoublePrecision>;
TYPED_TEST_SUITE(NodesAheadOf, Precisions);

TYPED_TEST(NodesAheadOf, ATileAreWhatItReachesFirst) {
  constexpr TileBox kBoxes[] = {kAnyStart, {{3, 3, 8}, {5, 4, 11}}, {{0, 0, 0}, {1, 1, 1}}, {{0, 0, 0}, {1, 5, 3}}};
  for (const TileBox& starts : kBoxes) {
    for (const std::uint32_t particles : {1U, 100U, 3000U}) {
      this->set(starts, particles);
      EXPECT_EQ(this->asked(), this->wanted());
    }
  }
}

TYPED_TEST(NodesAheadOf, HalfAStepAreInItsArray) {
  this->set(kAnyStart, 100);
  this->arguments_.scatter = false;
  EXPECT_EQ(this->asked(), this->wanted());
  this->arguments_.scatter = true;
  this->arguments_.gather = false;
  EXPECT_EQ(this->asked(), this->wanted());
}

TYPED_TEST(NodesAheadOf, NoTileAreNone) {
  this->set(kAnyStart, 100);
  NodesAhead<TypeParam> nodes(this->arguments_, this->tiles_[0], kNoTile);
  nodes.for_each_line(0, [](const auto*) { ADD_FAILURE(); });
}

}  // namespace
}  // namespace breccia::grid

// Which block every particle lies in at a sorting, and which particles are alone.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "grid/blocks.hpp"

namespace breccia::grid {

/// A particle on the way to its tile: where it is now and its nearest node in global coordinates.
struct Placement {
  std::uint32_t slot;
  std::int32_t node[3];
};

constexpr BlockCoord block_of(const Placement& p) { return {p.node[0] >> 2, p.node[1] >> 2, p.node[2] >> 2}; }

/// The particles of a block: how many, and the node of the first.
struct Occupant {
  BlockKey block;
  std::uint32_t count;
  std::int32_t node[3];
};

/// Where a particle goes, in one word that lies in place of its node while particles are sorted: block and cell in it.
struct BlockCell {
  std::uint32_t block;  ///< index in Occupancy::blocks()
  int x, y, z;          ///< cell, 0 to 3

  [[nodiscard]] constexpr std::int32_t packed() const {
    return static_cast<std::int32_t>(block << 6 | static_cast<std::uint32_t>(z << 4 | y << 2 | x));
  }
  static constexpr BlockCell of(std::int32_t packed) {
    return {static_cast<std::uint32_t>(packed) >> 6, packed & 3, packed >> 2 & 3, packed >> 4 & 3};
  }
};

/// The blocks that hold particles, in the order in which they were met.
class Occupancy {
 public:
  /// Counts a particle. Throws NumericsError beyond 67 million blocks.
  BlockCell add(const std::int32_t (&node)[3]);
  /// The blocks of these particles; behind them those that other ranks told of.
  [[nodiscard]] const std::vector<Occupant>& blocks() const { return blocks_; }
  /// A block of another rank.
  void tell(const Occupant& occupant);
  /// Whether the one particle of block `b` shares no node with another one, even after both have drifted one node.
  /// Blocks next to it that this rank knows nothing of make `is_known(block)` false: then it counts as not alone.
  template <class F>
  [[nodiscard]] bool is_alone(std::uint32_t b, const Periodicity& periodicity, F&& is_known) const {
    if (blocks_[b].count != 1) return false;
    const BlockCoord own = block_coord(blocks_[b].block);
    for (int n = 0; n < 27; ++n) {
      const BlockCoord offset{n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
      const BlockCoord there = periodicity.wrap({own.x + offset.x, own.y + offset.y, own.z + offset.z});
      if (!is_known(there)) return false;
      if (n != 13 && is_near(blocks_[b], offset, there)) return false;
    }
    return true;
  }

 private:
  [[nodiscard]] bool is_near(const Occupant& lone, BlockCoord offset, BlockCoord there) const;

  BlockTable table_;
  std::vector<Occupant> blocks_;
};

}  // namespace breccia::grid

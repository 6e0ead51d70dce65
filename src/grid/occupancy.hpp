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

/// Whether is_known(block) holds for the blocks at and beside `block` along `axis`, which speak for their planes.
template <class F>
bool known_around(BlockCoord block, int axis, const Periodicity& periodicity, F&& is_known) {
  for (const std::int32_t side : {-1, 0, 1}) {
    BlockCoord there = block;
    (axis == 0 ? there.x : axis == 1 ? there.y : there.z) += side;
    if (!is_known(periodicity.wrap(there))) return false;
  }
  return true;
}

/// The blocks that hold particles, in the order in which they were met.
class Occupancy {
 public:
  /// Makes room for so many blocks.
  void reserve(std::size_t blocks) { table_.reserve(blocks); }
  /// Counts a particle. Throws NumericsError beyond 67 million blocks.
  BlockCell add(const std::int32_t (&node)[3]);
  /// The blocks of these particles; behind them those that other ranks told of.
  [[nodiscard]] const std::vector<Occupant>& blocks() const { return blocks_; }
  /// A block of another rank.
  void tell(const Occupant& occupant);
  /// Adds what `other` has counted; returns the places of its blocks here.
  std::vector<std::uint32_t> merge(const Occupancy& other);
  /// To be called before is_alone, when all blocks are known; on so many threads.
  void count_cubes(int threads);
  /// Whether the one particle of block `b` shares no node with another one, even after both have drifted one node.
  [[nodiscard]] bool is_alone(std::uint32_t b, const Periodicity& periodicity) const;

 private:
  [[nodiscard]] bool is_near(const Occupant& lone, BlockCoord offset, BlockCoord there) const;
  // Whether nothing else lies in the cubes that the block and those around it belong to: that settles nearly all cases.
  [[nodiscard]] bool cubes_are_empty(BlockCoord block, const Periodicity& periodicity) const;

  BlockTable table_;
  std::vector<Occupant> blocks_;
  // Cubes of 4 x 4 x 4 blocks and how many of these are occupied; a cube's key says in which part it is.
  struct CubePart {
    BlockTable cubes;
    std::vector<std::uint32_t> occupied;
  };
  [[nodiscard]] std::size_t part_of(BlockKey cube) const { return key_hash(cube, 32) % cube_parts_.size(); }
  std::vector<CubePart> cube_parts_;
};

}  // namespace breccia::grid

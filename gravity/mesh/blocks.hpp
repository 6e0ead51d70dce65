// The particles counted in cubic blocks of space, of which only the occupied ones exist.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "gravity/mesh/geometry.hpp"
#include "gravity/solver.hpp"

namespace breccia::gravity {

struct BlockIndex {
  std::int32_t x, y, z;

  friend bool operator==(BlockIndex a, BlockIndex b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
};

inline std::uint64_t hash_of(BlockIndex index) {
  const auto part = [](std::int32_t i) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)); };
  std::uint64_t h = part(index.x) * 0x9e3779b97f4a7c15ULL;
  h = (h ^ (h >> 32) ^ part(index.y)) * 0xbf58476d1ce4e5b9ULL;
  h = (h ^ (h >> 29) ^ part(index.z)) * 0x94d049bb133111ebULL;
  return h ^ (h >> 31);
}

/// Of position p; blocks have 1/per_width [m]. Beyond 2e9 blocks from the origin all are the last one.
inline BlockIndex block_of(Vec3d p, double per_width) {
  const auto coordinate = [per_width](double x) {
    const double scaled = std::clamp(per_width * x, -2e9, 2e9);
    const auto towards_zero = static_cast<std::int32_t>(scaled);
    return towards_zero - (scaled < towards_zero ? 1 : 0);
  };
  return {coordinate(p.x), coordinate(p.y), coordinate(p.z)};
}

/// The particles in one block.
struct Block {
  BlockIndex index;
  std::int64_t count = 0;
  double mass = 0.0;
  Box bounds{};

  void add(std::int64_t n, double m, const Box& b);
};

/// Blocks in the order in which their first particles came, found by a hash of their index.
class Blocks {
 public:
  Blocks() { slots_.assign(64, -1); }

  /// The block, made if it is not there yet.
  Block& at(BlockIndex index) { return all_[static_cast<std::size_t>(place_of(index))]; }
  /// Its place in all(), which it keeps.
  std::int64_t place_of(BlockIndex index);
  /// Brings the memory that at() or find() of this block will ask for first.
  void prefetch(BlockIndex index) const;
  /// Place of a block in all(), or -1.
  [[nodiscard]] std::int64_t find(BlockIndex index) const { return slots_[slot_of(index)]; }
  [[nodiscard]] const std::vector<Block>& all() const { return all_; }
  [[nodiscard]] std::vector<Block>& all() { return all_; }

 private:
  [[nodiscard]] std::size_t slot_of(BlockIndex index) const;
  void grow();

  std::vector<Block> all_;
  std::vector<std::int32_t> slots_;  // place of a block in all_, -1: free; a power of two, at least twice the blocks
};

/// Those of this rank, cubes of `width` [m].
Blocks count_in_blocks(ParticlesView particles, double width);

/// How many blocks hold how many particles, those of all ranks counted together.
struct Occupancy {
  std::int64_t particles;  ///< in each of these blocks
  std::int64_t blocks;
};

/// Emptiest blocks first. Collective; each rank sees a share of the blocks of all.
std::vector<Occupancy> occupancy(ParticlesView particles, double width, const mpi::Comm& comm);

}  // namespace breccia::gravity

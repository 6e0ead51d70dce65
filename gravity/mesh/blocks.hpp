// The particles counted in cubic blocks of space, of which only the occupied ones exist.
#pragma once

#include <cstdint>
#include <vector>

#include "gravity/mesh/block_index.hpp"
#include "gravity/mesh/box.hpp"
#include "gravity/solver.hpp"

namespace breccia::gravity {

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

}  // namespace breccia::gravity

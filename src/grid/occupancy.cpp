#include "grid/occupancy.hpp"

#include <cstdlib>

#include "breccia/error.hpp"

namespace breccia::grid {

BlockCell Occupancy::add(const std::int32_t (&node)[3]) {
  constexpr std::size_t kMostBlocks = std::size_t{1} << 26;
  const BlockKey key = block_key({node[0] >> 2, node[1] >> 2, node[2] >> 2});
  const std::uint32_t b = table_.insert(key);
  if (b == blocks_.size()) {
    if (b == kMostBlocks) throw NumericsError("particles in more than 67 million blocks of a rank: use more ranks");
    blocks_.push_back({key, 0, {node[0], node[1], node[2]}});
  }
  ++blocks_[b].count;
  return {b, node[0] & 3, node[1] & 3, node[2] & 3};
}

void Occupancy::tell(const Occupant& occupant) {
  table_.insert(occupant.block);
  blocks_.push_back(occupant);
}

bool Occupancy::is_near(const Occupant& lone, BlockCoord offset, BlockCoord there) const {
  // Stencils touch when nearest nodes differ by at most 2 along every axis, and each particle may drift one node until
  // the next sorting.
  constexpr std::int32_t kReach = 2 + 2;
  const std::uint32_t b = table_.find(block_key(there));
  if (b == kNoBlock) return false;
  const Occupant& other = blocks_[b];
  if (other.count > 1) return true;
  bool near = true;
  for (int axis = 0; axis < 3; ++axis) {
    const int apart = kBlockWidth * component(offset, axis) + (other.node[axis] & 3) - (lone.node[axis] & 3);
    near = near && std::abs(apart) <= kReach;
  }
  return near;
}

}  // namespace breccia::grid

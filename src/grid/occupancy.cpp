#include "grid/occupancy.hpp"

#include <cstdlib>

namespace breccia::grid {

Occupancy::Occupancy(std::span<const Placement> placements) : block_of_placement_(placements.size()) {
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const Placement& p = placements[i];
    const BlockKey key = block_key(block_of(p));
    const std::uint32_t b = table_.insert(key);
    if (b == blocks_.size()) blocks_.push_back({key, 0, {p.node[0], p.node[1], p.node[2]}});
    ++blocks_[b].count;
    block_of_placement_[i] = b;
  }
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

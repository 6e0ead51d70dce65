#include "grid/occupancy.hpp"

#include <algorithm>
#include <cstdlib>

#include "breccia/error.hpp"
#include "grid/shares.hpp"

namespace breccia::grid {
namespace {

// For one more block: its number must leave six bits of a word to the cell.
void require_room(std::size_t blocks) {
  constexpr std::size_t kMostBlocks = std::size_t{1} << 26;
  if (blocks == kMostBlocks) throw NumericsError("particles in more than 67 million blocks of a rank: use more ranks");
}

}  // namespace

BlockCell Occupancy::add(const std::int32_t (&node)[3]) {
  const BlockKey key = block_key({node[0] >> 2, node[1] >> 2, node[2] >> 2});
  const std::uint32_t b = table_.insert(key);
  if (b == blocks_.size()) {
    require_room(b);
    blocks_.push_back({key, 0, {node[0], node[1], node[2]}});
  }
  ++blocks_[b].count;
  return {b, node[0] & 3, node[1] & 3, node[2] & 3};
}

std::vector<std::uint32_t> Occupancy::merge(const Occupancy& other) {
  std::vector<std::uint32_t> place;
  place.reserve(other.blocks_.size());
  for (const Occupant& o : other.blocks_) {
    const std::uint32_t b = table_.insert(o.block);
    if (b == blocks_.size()) {
      require_room(b);
      blocks_.push_back(o);
    } else {
      blocks_[b].count += o.count;
    }
    place.push_back(b);
  }
  return place;
}

void Occupancy::tell(const Occupant& occupant) {
  table_.insert(occupant.block);
  blocks_.push_back(occupant);
}

void Occupancy::count_cubes(int threads) {
  cube_parts_.assign(static_cast<std::size_t>(threads), {});
  for_each_share(threads, cube_parts_.size(), [&](std::size_t n) {
    CubePart& part = cube_parts_[n];
    part.cubes.reserve(blocks_.size() / cube_parts_.size());
    for (const Occupant& o : blocks_) {
      const BlockCoord b = block_coord(o.block);
      const BlockKey key = block_key({b.x >> 2, b.y >> 2, b.z >> 2});
      if (part_of(key) != n) continue;
      const std::uint32_t cube = part.cubes.insert(key);
      if (cube == part.occupied.size()) part.occupied.push_back(0);
      ++part.occupied[cube];
    }
  });
}

bool Occupancy::cubes_are_empty(BlockCoord block, const Periodicity& periodicity) const {
  // A block beside itself is never alone.
  if (std::ranges::find(periodicity.blocks, 1) != periodicity.blocks.end()) return false;
  // Along each axis the cubes of the block and of those beside it, the same ones once. Where a period makes the two
  // outer ones the same that cube counts twice: then the blocks themselves are looked at.
  std::int32_t along[3][3];
  int count[3];
  for (int axis = 0; axis < 3; ++axis) {
    count[axis] = 0;
    for (const std::int32_t side : {-1, 0, 1}) {
      const std::int32_t cube = periodicity.wrap(component(block, axis) + side, axis) >> 2;
      if (count[axis] == 0 || along[axis][count[axis] - 1] != cube) along[axis][count[axis]++] = cube;
    }
  }
  std::uint32_t occupied = 0;
  for (int i = 0; i < count[0]; ++i) {
    for (int j = 0; j < count[1]; ++j) {
      for (int k = 0; k < count[2]; ++k) {
        const BlockKey key = block_key({along[0][i], along[1][j], along[2][k]});
        const CubePart& part = cube_parts_[part_of(key)];
        const std::uint32_t cube = part.cubes.find(key);
        if (cube != kNoBlock) occupied += part.occupied[cube];
        if (occupied > 1) return false;
      }
    }
  }
  return true;
}

bool Occupancy::is_alone(std::uint32_t b, const Periodicity& periodicity) const {
  if (blocks_[b].count != 1) return false;
  const BlockCoord own = block_coord(blocks_[b].block);
  if (cubes_are_empty(own, periodicity)) return true;
  for (int n = 0; n < 27; ++n) {
    if (n == 13) continue;
    const BlockCoord offset{n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
    const BlockCoord there = periodicity.wrap({own.x + offset.x, own.y + offset.y, own.z + offset.z});
    if (is_near(blocks_[b], offset, there)) return false;
  }
  return true;
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

#include "cuda/device_load.hpp"

#include <vector>

#include "grid/occupancy.hpp"

namespace breccia::cuda {
namespace {

using grid::BlockCoord;

// Along each axis, whether the block before and the one behind is reached: bits 0 and 1, 2 and 3, 4 and 5.
unsigned sides_of(const std::int32_t (&node)[3]) {
  unsigned sides = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int cell = node[axis] & (grid::kBlockWidth - 1);
    if (cell < grid::kTileMargin) sides |= 1U << (2 * axis);
    if (cell >= grid::kBlockWidth - grid::kTileMargin) sides |= 2U << (2 * axis);
  }
  return sides;
}

bool reaches(unsigned sides, int axis, int direction) {
  return direction == 0 || (sides >> (2 * axis) & (direction < 0 ? 1U : 2U)) != 0;
}

void reach(BlockCoord own, unsigned sides, const grid::Periodicity& periodicity, grid::BlockTable& blocks) {
  for (int n = 0; n < 27; ++n) {
    const BlockCoord d{n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
    if (!reaches(sides, 0, d.x) || !reaches(sides, 1, d.y) || !reaches(sides, 2, d.z)) continue;
    blocks.insert(grid::block_key(periodicity.wrap({own.x + d.x, own.y + d.y, own.z + d.z})));
  }
}

}  // namespace

OwnPlanes planes_of_rank(const mpi::Slabs& slabs, int rank) {
  const std::vector<std::int32_t>& cuts = slabs.cuts();
  const auto at = static_cast<std::size_t>(rank);
  OwnPlanes planes{.axis = slabs.axis()};
  if (at > 0) planes.low = mpi::block_of_plane(cuts[at - 1]);
  if (at < cuts.size()) planes.high = mpi::block_of_plane(cuts[at]);
  return planes;
}

Load count_load(const EngineState& state, std::uint64_t flaws, const grid::Periodicity& periodicity,
                bool lone_without_grid, const OwnPlanes& planes) {
  grid::Occupancy occupancy;
  std::vector<unsigned> sides;  // by block
  for (std::size_t i = 0; i < state.particles; ++i) {
    const std::int32_t* of_particle = state.node.data() + 3 * i;
    const std::int32_t node[3] = {of_particle[0], of_particle[1], of_particle[2]};
    const std::uint32_t block = occupancy.add(node).block;
    sides.resize(occupancy.blocks().size(), 0U);
    sides[block] |= sides_of(node);
  }
  const std::size_t occupied = occupancy.blocks().size();
  const auto is_known = [&](BlockCoord there) {
    const std::int32_t plane = grid::component(there, planes.axis);
    return planes.low <= plane && plane < planes.high;
  };
  occupancy.count_cubes(1);
  const auto is_alone = [&](std::uint32_t b) {
    const BlockCoord own = grid::block_coord(occupancy.blocks()[b].block);
    return occupancy.is_alone(b, periodicity) && grid::known_around(own, planes.axis, periodicity, is_known);
  };
  Load load{.particles = state.particles, .flaws = flaws};
  grid::BlockTable blocks;
  for (std::uint32_t b = 0; b < occupied; ++b) {
    if (lone_without_grid && is_alone(b)) {
      ++load.lone;
      continue;
    }
    ++load.tiles;
    reach(grid::block_coord(occupancy.blocks()[b].block), sides[b], periodicity, blocks);
  }
  load.blocks = blocks.size();
  for (const grid::BlockKey key : blocks.keys()) {
    const BlockCoord block = grid::block_coord(key);
    for (const int side : {-1, 1}) {
      BlockCoord there = block;
      (planes.axis == 0 ? there.x : planes.axis == 1 ? there.y : there.z) += side;
      if (!is_known(block) || !is_known(periodicity.wrap(there))) ++load.shared;
    }
  }
  return load;
}

}  // namespace breccia::cuda

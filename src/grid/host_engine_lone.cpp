// Which particles share no node with another one until the next sorting.
#include <array>
#include <cstdlib>

#include "grid/host_engine.hpp"

namespace breccia::grid {
namespace {

constexpr BlockCoord block_of(const Placement& p) { return {p.node[0] >> 2, p.node[1] >> 2, p.node[2] >> 2}; }

// The particles of a block: how many, and the node of the first.
struct Occupant {
  BlockKey block;
  std::uint32_t count;
  std::int32_t node[3];
};

struct Occupants {
  BlockTable blocks;
  std::vector<Occupant> of_block;
  std::vector<std::uint32_t> block_of_placement;

  explicit Occupants(std::span<const Placement> placements) {
    for (const Placement& p : placements) {
      const BlockKey key = block_key(block_of(p));
      const std::uint32_t b = blocks.insert(key);
      if (b == of_block.size()) of_block.push_back({key, 0, {p.node[0], p.node[1], p.node[2]}});
      ++of_block[b].count;
      block_of_placement.push_back(b);
    }
  }
};

// Stencils touch when nearest nodes differ by at most 2 along every axis, and each particle may drift one node until
// the next sorting.
constexpr std::int32_t kReach = 2 + 2;

}  // namespace

template <class P>
SortedPlacements HostEngine<P>::separate(std::vector<Placement> placements) {
  SortedPlacements sorted;
  // Walls act on nodes: a particle needs them near one.
  if (boundaries_.has_walls() || !setup_.numerics.lone_without_grid) {
    sorted.tiled = std::move(placements);
    return sorted;
  }
  Occupants occupants(placements);
  // What other ranks hold is not known here, unless they tell.
  const bool others_tell = setup_.numerics.reproducible && comm_.size() > 1;
  if (others_tell) {
    const std::size_t own = occupants.of_block.size();
    std::vector<std::vector<Occupant>> to(static_cast<std::size_t>(comm_.size()));
    for (std::size_t n = 0; n < own; ++n) {
      const Occupant& o = occupants.of_block[n];
      const std::int32_t own_plane = component(block_coord(o.block), slabs_.axis());
      for (const std::int32_t side : {-1, 1}) {
        const int rank = slabs_.owner(kBlockWidth * periodicity_.wrap(own_plane + side, slabs_.axis()));
        auto& told = to[static_cast<std::size_t>(rank)];
        const bool known = !told.empty() && told.back().block == o.block;
        if (rank != comm_.rank() && !known) told.push_back(o);
      }
    }
    for (const std::vector<Occupant>& told : comm_.alltoall(to)) {
      for (const Occupant& o : told) {
        occupants.blocks.insert(o.block);
        occupants.of_block.push_back(o);
      }
    }
  }
  const auto is_alone = [&](std::size_t i) {
    if (occupants.of_block[occupants.block_of_placement[i]].count != 1) return false;
    const Placement& p = placements[i];
    const BlockCoord own = block_of(p);
    for (int n = 0; n < 27; ++n) {
      const std::array<int, 3> d = {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
      const BlockCoord there = periodicity_.wrap({own.x + d[0], own.y + d[1], own.z + d[2]});
      if (!others_tell && own_planes(there) != kAllPlanes) return false;
      if (n == 13) continue;
      const std::uint32_t b = occupants.blocks.find(block_key(there));
      if (b == kNoBlock) continue;
      const Occupant& other = occupants.of_block[b];
      if (other.count > 1) return false;
      bool near = true;
      for (int axis = 0; axis < 3; ++axis) {
        const int apart = kBlockWidth * d[static_cast<std::size_t>(axis)] + (other.node[axis] & 3) - (p.node[axis] & 3);
        near = near && std::abs(apart) <= kReach;
      }
      if (near) return false;
    }
    return true;
  };
  sorted.tiled.reserve(placements.size());
  for (std::size_t i = 0; i < placements.size(); ++i) {
    (is_alone(i) ? sorted.lone : sorted.tiled).push_back(placements[i]);
  }
  return sorted;
}

template <class P>
bool HostEngine<P>::lone_strayed() const {
  for (std::uint32_t n = 0; n < lone_.particles; ++n) {
    const std::size_t slot = lone_.first_pack * kLanes + n;
    const std::int32_t now = store_.kinematics[slot / kLanes].node[static_cast<int>(slot % kLanes)];
    for (int axis = 0; axis < 3; ++axis) {
      const int drift = ((now >> (8 * axis)) & 255) - ((lone_node_[n] >> (8 * axis)) & 255);
      if (std::abs(drift) > 1) return true;
    }
  }
  return false;
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

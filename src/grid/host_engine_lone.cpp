// Which particles share no node with another one until the next sorting.
#include <cstdlib>

#include "grid/host_engine.hpp"

namespace breccia::grid {

template <class P>
std::vector<char> HostEngine<P>::find_lone(Occupancy& occupancy) const {
  const std::size_t own = occupancy.blocks().size();
  // Walls act on nodes: a particle needs them near one.
  if (boundaries_.has_walls() || !setup_.numerics.lone_without_grid) return std::vector<char>(own, 0);
  // What other ranks hold is not known here, unless they tell.
  const bool others_tell = setup_.numerics.reproducible && comm_.size() > 1;
  if (others_tell) tell_neighbours(occupancy);
  occupancy.count_cubes(setup_.threads);
  const auto is_known = [&](BlockCoord block) {
    return others_tell || comm_.size() == 1 || known_around(block, slabs_.axis(), periodicity_, [&](BlockCoord there) {
             return own_planes(there) == kAllPlanes;
           });
  };
  std::vector<char> lone(own);
#pragma omp parallel for schedule(static) num_threads(setup_.threads)
  for (std::uint32_t b = 0; b < own; ++b) {
    lone[b] = occupancy.is_alone(b, periodicity_) && is_known(block_coord(occupancy.blocks()[b].block)) ? 1 : 0;
  }
  return lone;
}

template <class P>
void HostEngine<P>::tell_neighbours(Occupancy& occupancy) const {
  std::vector<std::vector<Occupant>> to(static_cast<std::size_t>(comm_.size()));
  for (const Occupant& o : occupancy.blocks()) {
    const std::int32_t plane = component(block_coord(o.block), slabs_.axis());
    for (const std::int32_t side : {-1, 1}) {
      const int rank = slabs_.owner(kBlockWidth * periodicity_.wrap(plane + side, slabs_.axis()));
      auto& told = to[static_cast<std::size_t>(rank)];
      const bool known = !told.empty() && told.back().block == o.block;
      if (rank != comm_.rank() && !known) told.push_back(o);
    }
  }
  for (const std::vector<Occupant>& told : comm_.alltoall(to)) {
    for (const Occupant& o : told) occupancy.tell(o);
  }
}

template <class P>
bool HostEngine<P>::has_drifted(std::size_t slot, std::int32_t sorted_node) const {
  const std::int32_t now = store_.kinematics[slot / kLanes].node[static_cast<int>(slot % kLanes)];
  for (int axis = 0; axis < 3; ++axis) {
    const int drift = ((now >> (8 * axis)) & 255) - ((sorted_node >> (8 * axis)) & 255);
    if (std::abs(drift) > 1) return true;
  }
  return false;
}

template <class P>
bool HostEngine<P>::lone_strayed() const {
  for (std::uint32_t n = 0; n < lone_.particles; ++n) {
    if (has_drifted(lone_.first_pack * kLanes + n, lone_node_[n])) return true;
  }
  return false;
}

template <class P>
bool HostEngine<P>::boundary_strayed() const {
  std::size_t known = 0;
  for (std::size_t t = 0; t < is_boundary_.size(); ++t) {
    if (is_boundary_[t] == 0) continue;
    for (std::uint32_t n = 0; n < tiles_[t].particles; ++n) {
      if (has_drifted(tiles_[t].first_pack * kLanes + n, boundary_node_[known++])) return true;
    }
  }
  return false;
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

// Slabs of the host engine: where they are cut at the start, what their planes cost, and how they change.
#include <array>
#include <cmath>
#include <type_traits>

#include "grid/host_engine.hpp"
#include "grid/work_weights.hpp"

namespace breccia::grid {
namespace {

constexpr WorkWeights kHostMixed{.tile = 1, .pack = 1, .lone_pack = 1, .intact_pack = 0};
constexpr WorkWeights kHostDouble{.tile = 1, .pack = 1, .lone_pack = 1, .intact_pack = 0};

template <class P>
constexpr WorkWeights kWeights = std::is_same_v<P, MixedPrecision> ? kHostMixed : kHostDouble;

std::uint64_t whole(double picoseconds) { return static_cast<std::uint64_t>(std::llround(picoseconds)); }

}  // namespace

template <class P>
void HostEngine<P>::choose_slabs(std::span<const Placement> placements) {
  std::array<mpi::PlaneWork, 3> mine;
  for (const Placement& p : placements) {
    for (std::size_t axis = 0; axis < 3; ++axis) ++mine[axis][p.node[axis] >> 2];
  }
  // Slabs across the longest extent of the matter share the fewest nodes.
  std::array<mpi::PlaneWork, 3> all;
  std::size_t longest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    all[axis] = mpi::sum_over_ranks(mine[axis], comm_);
    if (mpi::extent(all[axis]) > mpi::extent(all[longest])) longest = axis;
  }
  const int axis = setup_.slab_axis.value_or(static_cast<int>(longest));
  slabs_ = mpi::Slabs::balanced(axis, all[static_cast<std::size_t>(axis)], comm_.size());
}

template <class P>
mpi::PlaneWork HostEngine<P>::work(std::span<const double> more) const {
  constexpr WorkWeights w = kWeights<P>;
  mpi::PlaneWork work;
  const auto add = [&](BlockCoord block, double cost) { work[component(block, slabs_.axis())] += whole(cost); };
  for (const Tile& tile : tiles_) {
    const double cost = w.tile + w.pack * packs_for(tile.particles) + w.intact_pack * intact_packs(tile);
    add(block_coord(blocks_.keys()[tile.block]), cost);
  }
  for (const BlockCoord block : lone_block_) add(block, w.lone_pack / kLanes);
  std::size_t n = 0;
  if (more.empty()) return work;
  for_each_particle([&](std::size_t, BlockCoord block) { add(block, more[n++]); });
  return work;
}

template <class P>
std::uint32_t HostEngine<P>::intact_packs(const Tile& tile) const {
  if (!store_.has(Group::kFlaws)) return 0;
  std::uint32_t packs = 0;
  for (std::uint32_t n = 0; n < tile.particles;) {
    const auto lane = static_cast<int>(n % kLanes);
    const bool intact = store_.damage_level[tile.first_pack + n / kLanes].root[lane] < Real(1);
    packs += intact ? 1 : 0;
    n = intact ? static_cast<std::uint32_t>((n / kLanes + 1) * kLanes) : n + 1;
  }
  return packs;
}

template <class P>
void HostEngine<P>::cut(const mpi::Slabs& slabs) {
  slabs_ = slabs;
  settle(place_all());
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

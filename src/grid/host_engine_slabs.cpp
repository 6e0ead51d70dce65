// Slabs of the host engine: where they are cut at the start, what their planes cost, and how they change.
#include <array>
#include <cmath>
#include <type_traits>

#include "grid/host_engine.hpp"
#include "grid/work_weights.hpp"

namespace breccia::grid {
namespace {

// One core of a Xeon with AVX-512, `breccia_bench work`: within 10 % of the time of full and thin tiles, a third below
// that of tiles with one particle that share no block with others. Damage that may grow or not makes no difference.
constexpr WorkWeights kHostMixed{.tile = 850e3, .pack = 630e3, .lone_pack = 160e3};
constexpr WorkWeights kHostDouble{.tile = 2000e3, .pack = 490e3, .lone_pack = 160e3};

template <class P>
constexpr WorkWeights kWeights = std::is_same_v<P, MixedPrecision> ? kHostMixed : kHostDouble;

std::uint64_t whole(double picoseconds) { return static_cast<std::uint64_t>(std::llround(picoseconds)); }

}  // namespace

template <class P>
void HostEngine<P>::choose_slabs(std::span<const Placement> placements) {
  std::array<mpi::PlaneWork, 3> mine;
  for (const Placement& p : placements) {
    const BlockCoord stack = stack_of(block_of(p));
    for (std::size_t axis = 0; axis < 3; ++axis) ++mine[axis][component(stack, static_cast<int>(axis))];
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
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    add(block_coord(stacks_[t]), w.tile + w.pack * packs_for(tiles_[t].particles));
  }
  for (const BlockCoord stack : lone_stack_) add(stack, w.lone_pack / kLanes);
  std::size_t n = 0;
  if (more.empty()) return work;
  for_each_particle([&](std::size_t, BlockCoord block) { add(block, more[n++]); });
  return work;
}

template <class P>
void HostEngine<P>::cut(const mpi::Slabs& slabs) {
  slabs_ = slabs;
  settle(place_all());
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

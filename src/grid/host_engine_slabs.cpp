// Slabs of the host engine: where they are cut at the start, what their planes cost, how they change, whose a plane is.
#include <array>
#include <cmath>
#include <numeric>
#include <type_traits>

#include "grid/host_engine.hpp"
#include "grid/work_weights.hpp"

namespace breccia::grid {
namespace {

// One core of a Xeon with AVX-512, `breccia_bench work`: within 8 % of the time of full, half full and thin tiles, up
// to a half above that of tiles with one particle. Damage that may grow or not makes no difference.
constexpr WorkWeights kHostMixed{.tile = 1700e3, .pack = 510e3, .lone_pack = 160e3};
constexpr WorkWeights kHostDouble{.tile = 3900e3, .pack = 435e3, .lone_pack = 160e3};

template <class P>
constexpr WorkWeights kWeights = std::is_same_v<P, MixedPrecision> ? kHostMixed : kHostDouble;

static_assert(mpi::kPlanesOfBlock == kBlockWidth);

std::uint64_t whole(double picoseconds) { return static_cast<std::uint64_t>(std::llround(picoseconds)); }

}  // namespace

template <class P>
void HostEngine<P>::choose_slabs(std::span<const Placement> placements) {
  std::array<mpi::PlaneWork, 3> mine;
  for (const Placement& p : placements) {
    for (std::size_t axis = 0; axis < 3; ++axis) ++mine[axis].nodes[p.node[axis]];
  }
  // Slabs across the longest extent of the matter share the fewest nodes.
  std::array<mpi::PlaneWork, 3> all;
  std::size_t longest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    all[axis] = mpi::sum_over_ranks(mine[axis], comm_);
    if (mpi::extent(all[axis]) > mpi::extent(all[longest])) longest = axis;
  }
  const int axis = setup_.slab_axis.value_or(static_cast<int>(longest));
  mpi::PlaneWork work;
  for (const auto& [plane, particles] : all[static_cast<std::size_t>(axis)].nodes) {
    work.nodes[plane & -planes_kept_together(axis)] += particles;
  }
  slabs_ = mpi::Slabs::balanced(axis, work, comm_.size());
}

template <class P>
mpi::PlaneWork HostEngine<P>::work(std::span<const double> more) const {
  constexpr WorkWeights w = kWeights<P>;
  mpi::PlaneWork work;
  const int axis = slabs_.axis();
  const std::int32_t together = planes_kept_together(axis);
  // A particle's lane of its pack goes with its plane; the tile and the lanes that stay empty are there on either side
  // of a cut through the block.
  std::size_t n = 0;
  const auto add = [&](std::size_t first_slot, std::uint32_t particles, BlockCoord stack, double lane, double tile) {
    std::array<std::uint64_t, kStackHeight> of_plane{};
    for (std::uint32_t i = 0; i < particles; ++i) {
      of_plane[plane_in_stack(first_slot + i)] += whole(lane) + (more.empty() ? 0 : whole(more[n++]));
    }
    // A tile is one block wide but along z, where a cut seldom finds its end: there its cost goes with its particles.
    if (axis == 2) {
      const auto all = static_cast<double>(std::accumulate(of_plane.begin(), of_plane.end(), std::uint64_t{0}));
      for (std::uint64_t& cost : of_plane) cost += whole(tile * static_cast<double>(cost) / all);
    } else {
      work.blocks[component(stack, axis)] += whole(tile);
    }
    const std::int32_t first = kBlockWidth * component(stack, axis);
    for (std::int32_t plane = 0; plane < kStackHeight; ++plane) {
      const std::uint64_t cost = of_plane[static_cast<std::size_t>(plane)];
      if (cost != 0) work.nodes[(first + plane) & -together] += cost;
    }
  };
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const auto empty = packs_for(tiles_[t].particles) * static_cast<std::uint32_t>(kLanes) - tiles_[t].particles;
    add(tiles_[t].first_pack * kLanes, tiles_[t].particles, block_coord(stacks_[t]), w.pack / kLanes,
        w.tile + empty * w.pack / kLanes);
  }
  for (std::uint32_t i = 0; i < lone_.particles; ++i) {
    add(lone_.first_pack * kLanes + i, 1, lone_stack_[i], w.lone_pack / kLanes, 0.0);
  }
  return work;
}

template <class P>
std::vector<SweepTile> HostEngine<P>::sweep_tiles() const {
  std::vector<SweepTile> tiles;
  tiles.reserve(tiles_.size());
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const double cost = kWeights<P>.tile + kWeights<P>.pack * packs_for(tiles_[t].particles);
    tiles.push_back({stacks_[t], is_boundary_[t] != 0, cost});
  }
  return tiles;
}

template <class P>
std::int32_t HostEngine<P>::planes_kept_together(int axis) const {
  // Ordered sums are those of whole tiles.
  if (setup_.numerics.reproducible) return axis == 2 ? kStackHeight : kBlockWidth;
  return setup_.divide_blocks ? 1 : kBlockWidth;
}

template <class P>
std::size_t HostEngine<P>::plane_in_stack(std::size_t slot) const {
  const std::int32_t packed = store_.kinematics[slot / kLanes].node[static_cast<int>(slot % kLanes)];
  return static_cast<std::size_t>(((packed >> (8 * slabs_.axis())) & 255) - kNodeBias);
}

template <class P>
std::uint32_t HostEngine<P>::own_planes(BlockCoord block) const {
  if (comm_.size() == 1) return kAllPlanes;
  std::uint32_t own = 0;
  for (std::int32_t n = 0; n < kBlockWidth; ++n) {
    if (slabs_.owner(first_plane(periodicity_.wrap(block)) + n) == comm_.rank()) own |= 1U << n;
  }
  return own;
}

template <class P>
void HostEngine<P>::cut(const mpi::Slabs& slabs) {
  slabs_ = slabs;
  settle(place_all());
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

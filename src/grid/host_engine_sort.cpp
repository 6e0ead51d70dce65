// Sorting: every particle to the rank that owns its node, to its tile, and inside the tile to the order of its cell.
#include <algorithm>
#include <string>
#include <utility>

#include "breccia/error.hpp"
#include "grid/host_engine.hpp"
#include "grid/shares.hpp"
#include "mpi/together.hpp"

namespace breccia::grid {
namespace {

constexpr std::int32_t floor_div4(std::int32_t n) { return n >> 2; }

}  // namespace

template <class P>
Placement HostEngine<P>::node_of(std::size_t slot, BlockCoord stack) const {
  const std::int32_t packed = store_.kinematics[slot / kLanes].node[static_cast<int>(slot % kLanes)];
  Placement p{static_cast<std::uint32_t>(slot), {}};
  for (int axis = 0; axis < 3; ++axis) {
    p.node[axis] = kBlockWidth * component(stack, axis) + ((packed >> (8 * axis)) & 255) - kNodeBias;
  }
  return p;
}

template <class P>
Placement HostEngine<P>::place(std::size_t slot, BlockCoord stack) const {
  Placement p = node_of(slot, stack);
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t node = p.node[axis];
    p.node[axis] = kBlockWidth * periodicity_.wrap(floor_div4(node), axis) + (node & 3);
  }
  return p;
}

template <class P>
void HostEngine<P>::require_in_grid() const {
  for_each_particle([&](std::size_t slot, BlockCoord stack) {
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis) {
      inside = inside && std::abs(component(stack, axis)) < kBlockLimit - kStackBlocks - 1;
    }
    if (inside) return;
    for (const std::int32_t node : place(slot, stack).node) {
      if (std::abs(floor_div4(node)) > kBlockLimit) {
        throw NumericsError("particle " + std::to_string(id(slot)) + " is more than 4 million cells from the origin");
      }
    }
  });
}

template <class P>
std::vector<Placement> HostEngine<P>::place_all() const {
  require_in_grid();
  std::vector<Placement> placements;
  placements.reserve(store_.packs() * kLanes);
  for_each_particle([&](std::size_t slot, BlockCoord stack) { placements.push_back(place(slot, stack)); });
  return placements;
}

template <class P>
double HostEngine<P>::work_of_periods() const {
  if (!boundaries_.repeats_along(setup_.uniform_gravity)) return 0.0;
  double work = 0.0;
  for_each_particle([&](std::size_t slot, BlockCoord stack) {
    const Vec3d moved = boundaries_.put_back(node_of(slot, stack).node);
    work += mass(slot) * dot(setup_.uniform_gravity, moved);
  });
  return work;
}

template <class P>
double HostEngine<P>::sort() {
  if (comm_.any(strayed())) throw NumericsError("particles moved more than a cell between two sortings");
  mpi::together<NumericsError>(comm_, [&] { require_in_grid(); });
  const double work = work_of_periods();
  settle_shares(share_packs(), [&](std::uint32_t first, std::uint32_t last, auto&& visit) {
    for_each_particle_of(first, last, [&](std::size_t slot, BlockCoord stack) { visit(place(slot, stack)); });
  });
  return work;
}

template <class P>
void HostEngine<P>::settle(std::span<const Placement> placements) {
  const std::uint32_t all[2] = {0, static_cast<std::uint32_t>(store_.packs())};
  settle_shares(all, [&](std::uint32_t, std::uint32_t, auto&& visit) { std::ranges::for_each(placements, visit); });
}

// Where the packs of each thread begin and the last one's end: those of whole tiles, about as many for each.
template <class P>
std::vector<std::uint32_t> HostEngine<P>::share_packs() const {
  std::vector<std::uint32_t> bounds = even_shares(store_.packs(), setup_.threads);
  for (std::size_t n = 1; n + 1 < bounds.size(); ++n) {
    const auto tile = std::ranges::lower_bound(tiles_, bounds[n], {}, &Tile::first_pack);
    bounds[n] = tile == tiles_.end() ? std::max(bounds[n], lone_.first_pack) : tile->first_pack;
  }
  return bounds;
}

// Share n has the packs bounds[n] .. bounds[n + 1] - 1; for_each_placement(first, last, visit) visits theirs.
template <class P>
template <class F>
void HostEngine<P>::settle_shares(std::span<const std::uint32_t> bounds, F&& for_each_placement) {
  drop_sums();
  drop_velocities();
  std::vector<SettledShare> shares(bounds.size() - 1);
  for_each_share(setup_.threads, shares.size(), [&](std::size_t n) {
    SettledShare& share = shares[n];
    share.leaving.resize(static_cast<std::size_t>(comm_.size()));
    share.occupancy.reserve((occupied_blocks_ + lone_.particles) / shares.size());  // as after the last sorting
    for_each_placement(bounds[n], bounds[n + 1], [&](const Placement& p) {
      const int rank = comm_.size() == 1 ? 0 : owner(p);
      if (rank == comm_.rank()) {
        set_destination(share.occupancy.add(p.node), p.slot);
      } else {
        put_record(p, share.leaving[static_cast<std::size_t>(rank)]);
      }
    });
  });
  Occupancy occupancy = join_shares(shares, bounds);
  if (comm_.size() > 1) {
    std::vector<std::vector<std::byte>>& leaving = shares.front().leaving;
    for (const SettledShare& share : std::span(shares).subspan(1)) {
      for (std::size_t rank = 0; rank < leaving.size(); ++rank) {
        leaving[rank].insert(leaving[rank].end(), share.leaving[rank].begin(), share.leaving[rank].end());
      }
    }
    take_records(comm_.alltoall(leaving), occupancy);
  }
  shares.clear();
  arrange(occupancy);
  connect_tiles();
  report_ = {};
  gathers_ = 0;
}

// One occupancy of all, with the particles' destinations in it.
template <class P>
Occupancy HostEngine<P>::join_shares(std::span<SettledShare> shares, std::span<const std::uint32_t> bounds) {
  // Blocks join those of the share that has most.
  const auto blocks = [](const SettledShare& share) { return share.occupancy.blocks().size(); };
  const auto most = static_cast<std::size_t>(std::ranges::max_element(shares, {}, blocks) - shares.begin());
  Occupancy all = std::move(shares[most].occupancy);
  std::vector<std::vector<std::uint32_t>> place(shares.size());
  for (std::size_t n = 0; n < shares.size(); ++n) {
    if (n != most) place[n] = all.merge(shares[n].occupancy);
  }
  for_each_share(setup_.threads, shares.size(), [&](std::size_t n) {
    if (n == most) return;
    for_each_destination(bounds[n], bounds[n + 1], [&](std::size_t slot, BlockCell to) {
      to.block = place[n][to.block];
      set_destination(to, slot);
    });
  });
  return all;
}

template <class P>
void HostEngine<P>::set_destination(BlockCell cell, std::size_t slot) {
  store_.kinematics[slot / kLanes].node.set(static_cast<int>(slot % kLanes), cell.packed());
}

template <class P>
bool HostEngine<P>::finish_damage() {
  if (!setup_.effects.damage) return true;
  bool all_broken = true;
  for_each_particle([&](std::size_t slot, BlockCoord) {
    all_broken = all_broken && store_.damage_level[slot / kLanes].root[static_cast<int>(slot % kLanes)] >= Real(1);
  });
  if (comm_.any(!all_broken)) return false;
  switch_damage_off();
  return true;
}

template <class P>
void HostEngine<P>::switch_damage_off() {
  setup_.effects.damage = false;
  setup_.effects.fully_damaged = true;
  store_.drop_damage();
  release(flaw_codes_);
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

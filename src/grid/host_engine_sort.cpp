// Sorting: every particle to the rank that owns its node, to its tile, and inside the tile to the order of its cell.
#include <algorithm>
#include <string>
#include <utility>

#include "breccia/error.hpp"
#include "grid/host_engine.hpp"
#include "mpi/together.hpp"

namespace breccia::grid {
namespace {

constexpr std::int32_t floor_div4(std::int32_t n) { return n >> 2; }

// Cells from the lowest of a stack.
struct CellInStack {
  int x, y, z;
  // In storage order: layers of two cells along z, whose stencils begin at the same pair of nodes (scatter_pairs.hpp);
  // in a layer columns, in a column its two cells. So particles that follow each other mostly share their stencil.
  [[nodiscard]] constexpr std::uint32_t index() const {
    const int pair = (z + 1) / 2;
    const int column = y * kBlockWidth + x;
    const bool whole = z > 0 && z < kStackHeight - 1;
    const int before = kBlockWidth * kBlockWidth * (pair == 0 ? 0 : 2 * pair - 1);
    return static_cast<std::uint32_t>(before + (whole ? 2 * column + ((z + 1) & 1) : column));
  }
  [[nodiscard]] constexpr std::int32_t packed() const {
    return (x + kNodeBias) | (y + kNodeBias) << 8 | (z + kNodeBias) << 16;
  }
};

constexpr std::uint32_t kNoTile = kNoBlock;

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
  settle_each(
      [&](auto&& visit) { for_each_particle([&](std::size_t slot, BlockCoord stack) { visit(place(slot, stack)); }); });
  return work;
}

template <class P>
void HostEngine<P>::settle(std::span<const Placement> placements) {
  settle_each([&](auto&& visit) { std::ranges::for_each(placements, visit); });
}

template <class P>
template <class F>
void HostEngine<P>::settle_each(F&& for_each_placement) {
  drop_sums();
  drop_velocities();
  Occupancy occupancy;
  std::vector<std::vector<std::byte>> leaving(static_cast<std::size_t>(comm_.size()));
  for_each_placement([&](const Placement& p) {
    const int rank = comm_.size() == 1 ? 0 : owner(p);
    if (rank == comm_.rank()) {
      set_destination(occupancy.add(p.node), p.slot);
    } else {
      put_record(p, leaving[static_cast<std::size_t>(rank)]);
    }
  });
  if (comm_.size() > 1) take_records(comm_.alltoall(leaving), occupancy);
  arrange(occupancy);
  connect_tiles();
  report_ = {};
  gathers_ = 0;
}

template <class P>
void HostEngine<P>::set_destination(BlockCell cell, std::size_t slot) {
  store_.kinematics[slot / kLanes].node.set(static_cast<int>(slot % kLanes), cell.packed());
}

// The tile of each block of particles in the order of their stacks, kNoTile where its particle is alone.
template <class P>
std::vector<std::uint32_t> HostEngine<P>::find_tiles(const Occupancy& occupancy, std::span<const char> lone) {
  struct Member {
    BlockKey stack;
    std::uint32_t block;
  };
  std::vector<Member> members;
  for (std::uint32_t b = 0; b < lone.size(); ++b) {
    const BlockKey block = occupancy.blocks()[b].block;
    if (lone[b] == 0) members.push_back({block_key(stack_of(block_coord(block))), b});
  }
  occupied_blocks_ = members.size();
  std::ranges::sort(members, {}, &Member::stack);
  std::vector<std::uint32_t> tile_of_block(lone.size(), kNoTile);
  stacks_.clear();
  for (const Member& m : members) {
    if (stacks_.empty() || stacks_.back() != m.stack) stacks_.push_back(m.stack);
    tile_of_block[m.block] = static_cast<std::uint32_t>(stacks_.size() - 1);
  }
  return tile_of_block;
}

// Calls visit(slot, cell) for the particles that have been sent to a cell, in the order of their slots.
template <class P>
template <class F>
void HostEngine<P>::for_each_destination(F&& visit) const {
  for (std::size_t p = 0; p < store_.packs(); ++p) {
    const Kinematics<P>& k = store_.kinematics[p];
    for (std::size_t l = 0; l < kLanes; ++l) {
      const int lane = static_cast<int>(l);
      if (k.mass[lane] > Real(0)) visit(p * kLanes + l, BlockCell::of(k.node[lane]));
    }
  }
}

template <class P>
void HostEngine<P>::arrange(Occupancy& occupancy) {
  const std::vector<char> lone = find_lone(occupancy);
  const std::vector<std::uint32_t> tile_of_block = find_tiles(occupancy, lone);
  // The lowest bits of a key are those of z.
  const auto in_stack = [&](const BlockCell& cell) {
    const auto block_in_stack = static_cast<int>(occupancy.blocks()[cell.block].block % kStackBlocks);
    return CellInStack{cell.x, cell.y, cell.z + kBlockWidth * block_in_stack};
  };

  // A counting sort over (tile, cell): it is stable.
  std::vector<std::uint32_t> place(stacks_.size() * kStackCells, 0U);
  occupied_cells_.assign(stacks_.size(), OccupiedCells{});
  std::uint32_t alone = 0;
  for_each_destination([&](std::size_t, const BlockCell& to) {
    const std::uint32_t t = tile_of_block[to.block];
    if (t == kNoTile) {
      ++alone;
      return;
    }
    const CellInStack cell = in_stack(to);
    ++place[std::size_t{t} * kStackCells + cell.index()];
    OccupiedCells& occupied = occupied_cells_[t];
    occupied.axis[0] = static_cast<std::uint16_t>(occupied.axis[0] | 1U << cell.x);
    occupied.axis[1] = static_cast<std::uint16_t>(occupied.axis[1] | 1U << cell.y);
    occupied.axis[2] = static_cast<std::uint16_t>(occupied.axis[2] | 1U << cell.z);
  });
  lay_out_tiles(place, alone);

  std::vector<std::uint32_t> source((lone_.first_pack + packs_for(alone)) * kLanes, ParticleStore<P>::kEmpty);
  lone_stack_.clear();
  lone_node_.clear();
  for_each_destination([&](std::size_t from, const BlockCell& to) {
    const CellInStack cell = in_stack(to);
    const std::uint32_t t = tile_of_block[to.block];
    std::size_t slot = lone_.first_pack * kLanes + lone_stack_.size();
    if (t != kNoTile) {
      slot = place[std::size_t{t} * kStackCells + cell.index()]++;
    } else {
      lone_stack_.push_back(stack_of(block_coord(occupancy.blocks()[to.block].block)));
      lone_node_.push_back(cell.packed());
    }
    source[slot] = static_cast<std::uint32_t>(from);
    store_.kinematics[from / kLanes].node.set(static_cast<int>(from % kLanes), cell.packed());
  });
  if (setup_.numerics.reproducible) sort_cells_by_id(source, place);
  lone_pull_.resize(packs_for(alone));
  const std::size_t beside = store_.gather(source, setup_.threads);
  count_bytes((source.capacity() + place.capacity()) * sizeof(std::uint32_t) + beside);
  // Empty lanes take part in the passes, with mass 0, so they need a node as well: that of the particle before them.
  for (std::size_t slot = 1; slot < source.size(); ++slot) {
    if (source[slot] != ParticleStore<P>::kEmpty) continue;
    const std::int32_t before = store_.kinematics[(slot - 1) / kLanes].node[static_cast<int>((slot - 1) % kLanes)];
    store_.kinematics[slot / kLanes].node.set(static_cast<int>(slot % kLanes), before);
  }
  if (store_.has(Group::kFlaws)) compact_flaws();
}

// Tiles and lone particles one after the other; of the numbers of particles in each cell become their first slots.
template <class P>
void HostEngine<P>::lay_out_tiles(std::span<std::uint32_t> place, std::uint32_t alone) {
  tiles_.assign(stacks_.size(), Tile{});
  std::uint32_t packs = 0;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    tiles_[t].first_pack = packs;
    std::uint32_t slot = packs * static_cast<std::uint32_t>(kLanes);
    for (std::size_t c = 0; c < kStackCells; ++c) {
      const std::uint32_t count = std::exchange(place[t * kStackCells + c], slot);
      slot += count;
      tiles_[t].particles += count;
    }
    packs += packs_for(tiles_[t].particles);
  }
  lone_ = {packs, alone};
}

template <class P>
void HostEngine<P>::sort_cells_by_id(std::span<std::uint32_t> source, std::span<const std::uint32_t> cell_ends) const {
  // Else the order would tell from which rank a particle came.
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    std::size_t first = tiles_[t].first_pack * kLanes;
    for (std::size_t c = 0; c < kStackCells; ++c) {
      const std::size_t last = cell_ends[t * kStackCells + c];
      const auto cell = source.subspan(first, last - first);
      if (cell.size() > 1) std::ranges::sort(cell, {}, [&](std::uint32_t slot) { return id(slot); });
      first = last;
    }
  }
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

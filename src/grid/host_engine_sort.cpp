// Sorting: every particle to the rank that owns its node, to its tile, and inside the tile to the order of its cell.
#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "breccia/error.hpp"
#include "grid/host_engine.hpp"
#include "mpi/message.hpp"
#include "mpi/together.hpp"

namespace breccia::grid {
namespace {

constexpr std::int32_t floor_div4(std::int32_t n) { return n >> 2; }

// Cells from the lowest of a stack.
struct CellInStack {
  int x, y, z;
  explicit constexpr CellInStack(const std::int32_t (&node)[3])
      : x(node[0] & (kBlockWidth - 1)), y(node[1] & (kBlockWidth - 1)), z(node[2] & (kStackHeight - 1)) {}
  // In storage order: z slowest, so that consecutive particles write to different rows of nodes.
  [[nodiscard]] constexpr std::uint32_t index() const {
    return static_cast<std::uint32_t>((z * kBlockWidth + y) * kBlockWidth + x);
  }
  [[nodiscard]] constexpr std::int32_t packed() const {
    return (x + kNodeBias) | (y + kNodeBias) << 8 | (z + kNodeBias) << 16;
  }
};

constexpr std::uint32_t kNoTile = kNoBlock;

using mpi::get;
using mpi::put;

}  // namespace

template <class P>
Placement HostEngine<P>::place(std::size_t slot, BlockCoord stack) const {
  const std::int32_t packed = store_.kinematics[slot / kLanes].node[static_cast<int>(slot % kLanes)];
  Placement p{static_cast<std::uint32_t>(slot), {}};
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t node = kBlockWidth * component(stack, axis) + ((packed >> (8 * axis)) & 255) - kNodeBias;
    p.node[axis] = kBlockWidth * periodicity_.wrap(floor_div4(node), axis) + (node & 3);
  }
  return p;
}

template <class P>
std::vector<Placement> HostEngine<P>::place_all() const {
  std::vector<std::size_t> first(tiles_.size() + 1, 0);
  for (std::size_t t = 0; t < tiles_.size(); ++t) first[t + 1] = first[t] + tiles_[t].particles;
  std::vector<Placement> placements(first.back() + lone_.particles);
#pragma omp parallel for schedule(static) num_threads(setup_.threads)
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const BlockCoord stack = block_coord(stacks_[t]);
    for (std::uint32_t n = 0; n < tiles_[t].particles; ++n) {
      placements[first[t] + n] = place(tiles_[t].first_pack * kLanes + n, stack);
    }
  }
  for (std::uint32_t n = 0; n < lone_.particles; ++n) {
    placements[first.back() + n] = place(lone_.first_pack * kLanes + n, lone_stack_[n]);
  }
  for (const Placement& p : placements) {
    for (const std::int32_t node : p.node) {
      if (std::abs(floor_div4(node)) > kBlockLimit) {
        throw NumericsError("particle " + std::to_string(id(p.slot)) + " is more than 4 million cells from the origin");
      }
    }
  }
  return placements;
}

template <class P>
void HostEngine<P>::sort() {
  if (comm_.any(strayed())) throw NumericsError("particles moved more than a cell between two sortings");
  std::vector<Placement> placements;
  mpi::together<NumericsError>(comm_, [&] { placements = place_all(); });
  settle(std::move(placements));
}

template <class P>
void HostEngine<P>::settle(std::vector<Placement> placements) {
  migrate(placements);
  arrange(placements);
  connect_tiles();
  report_ = {};
  gathers_ = 0;
}

template <class P>
void HostEngine<P>::migrate(std::vector<Placement>& placements) {
  if (comm_.size() == 1) return;
  const bool with_flaws = store_.has(Group::kFlaws);
  const std::size_t bytes = store_.record_bytes();
  std::vector<std::vector<std::byte>> to(static_cast<std::size_t>(comm_.size()));
  std::vector<std::byte> record(bytes);
  std::erase_if(placements, [&](const Placement& p) {
    const int rank = owner(p);
    if (rank == comm_.rank()) return false;
    auto& message = to[static_cast<std::size_t>(rank)];
    put(message, p.node, 3);
    store_.read_record(p.slot, record.data());
    put(message, record.data(), bytes);
    if (with_flaws) {
      const std::span<const material::FlawCode> own = flaws_of(p.slot);
      put(message, own.data(), own.size());
    }
    return true;
  });
  for (const std::vector<std::byte>& message : comm_.alltoall(to)) {
    const std::byte* from = message.data();
    const std::byte* const end = from + message.size();
    while (from != end) {
      // A pack at a time: slots are cheap until arrange() closes the gaps.
      const std::size_t slot = store_.packs() * kLanes;
      store_.append_packs(1);
      for (std::size_t lane = 0; lane < kLanes && from != end; ++lane) {
        Placement p{static_cast<std::uint32_t>(slot + lane), {}};
        get(from, p.node, 3);
        store_.write_record(p.slot, from);
        from += bytes;
        if (with_flaws) {
          Flaws<P>& f = store_.flaws[p.slot / kLanes];
          const auto count = static_cast<std::size_t>(FlawState::of(f.state[static_cast<int>(lane)]).all);
          f.first.set(static_cast<int>(lane), static_cast<std::int32_t>(flaw_codes_.size()));
          flaw_codes_.resize(flaw_codes_.size() + count);
          get(from, flaw_codes_.data() + flaw_codes_.size() - count, count);
        }
        placements.push_back(p);
      }
    }
  }
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

template <class P>
void HostEngine<P>::arrange(std::span<const Placement> placements) {
  Occupancy occupancy(placements);
  const std::vector<char> lone = find_lone(occupancy);
  const std::vector<std::uint32_t> tile_of_block = find_tiles(occupancy, lone);
  const auto tile_of = [&](std::size_t i) { return tile_of_block[occupancy.block_of_placement()[i]]; };

  // A counting sort over (tile, cell): it is stable.
  std::vector<std::uint32_t> place(stacks_.size() * kStackCells, 0U);
  occupied_cells_.assign(stacks_.size(), OccupiedCells{});
  std::uint32_t alone = 0;
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const std::uint32_t t = tile_of(i);
    if (t == kNoTile) {
      ++alone;
      continue;
    }
    const CellInStack cell(placements[i].node);
    ++place[std::size_t{t} * kStackCells + cell.index()];
    OccupiedCells& occupied = occupied_cells_[t];
    occupied.axis[0] = static_cast<std::uint16_t>(occupied.axis[0] | 1U << cell.x);
    occupied.axis[1] = static_cast<std::uint16_t>(occupied.axis[1] | 1U << cell.y);
    occupied.axis[2] = static_cast<std::uint16_t>(occupied.axis[2] | 1U << cell.z);
  }
  tiles_.assign(stacks_.size(), Tile{});
  boxes_.assign(stacks_.size(), kWholeTile);
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
  packs += packs_for(alone);

  std::vector<std::uint32_t> source(packs * kLanes, ParticleStore<P>::kEmpty);
  std::vector<std::int32_t> node(source.size(), CellInStack({0, 0, 0}).packed());
  lone_stack_.clear();
  lone_node_.clear();
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const CellInStack cell(placements[i].node);
    const std::uint32_t t = tile_of(i);
    std::size_t slot = lone_.first_pack * kLanes + lone_stack_.size();
    if (t != kNoTile) {
      slot = place[std::size_t{t} * kStackCells + cell.index()]++;
    } else {
      lone_stack_.push_back(stack_of(block_of(placements[i])));
      lone_node_.push_back(cell.packed());
    }
    source[slot] = placements[i].slot;
    node[slot] = cell.packed();
  }
  if (setup_.numerics.reproducible) sort_cells_by_id(source, place);
  lone_pull_.resize(packs_for(alone));
  store_.gather(source, setup_.threads);
  for (std::size_t s = 0; s < node.size(); ++s)
    store_.kinematics[s / kLanes].node.set(static_cast<int>(s % kLanes), node[s]);
  if (store_.has(Group::kFlaws)) compact_flaws();
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
void HostEngine<P>::compact_flaws() {
  if (comm_.size() == 1) return;  // none has gone
  std::size_t live = 0;
  for_each_particle([&](std::size_t slot, BlockCoord) { live += flaws_of(slot).size(); });
  if (flaw_codes_.size() <= 2 * live) return;
  std::vector<material::FlawCode> kept;
  kept.reserve(live);
  for_each_particle([&](std::size_t slot, BlockCoord) {
    const std::span<const material::FlawCode> own = flaws_of(slot);
    store_.flaws[slot / kLanes].first.set(static_cast<int>(slot % kLanes), static_cast<std::int32_t>(kept.size()));
    kept.insert(kept.end(), own.begin(), own.end());
  });
  flaw_codes_ = std::move(kept);
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
  flaw_codes_ = {};
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

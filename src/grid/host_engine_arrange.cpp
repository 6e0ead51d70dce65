// Particles whose block is known into the order of tiles and cells, in all their fields.
#include <algorithm>
#include <utility>

#include "grid/cell_counts.hpp"
#include "grid/host_engine.hpp"
#include "grid/shares.hpp"

namespace breccia::grid {
namespace {

// More threads do not count faster, as their counts are to be added up.
constexpr int kMostCounters = 4;

}  // namespace

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
void HostEngine<P>::arrange(Occupancy& occupancy) {
  const std::vector<char> lone = find_lone(occupancy);
  const std::vector<std::uint32_t> tile_of_block = find_tiles(occupancy, lone);
  const std::vector<std::uint32_t> source = order_particles(occupancy, tile_of_block);
  lone_pull_.resize(packs_for(lone_.particles));
  const std::size_t beside = store_.gather(source, setup_.threads);
  count_bytes(source.capacity() * sizeof(std::uint32_t) + beside);
  // Empty lanes take part in the passes, with mass 0, so they need a node as well: that of the particle before them.
  for (std::size_t slot = 1; slot < source.size(); ++slot) {
    if (source[slot] != ParticleStore<P>::kEmpty) continue;
    const std::int32_t before = store_.kinematics[(slot - 1) / kLanes].node[static_cast<int>((slot - 1) % kLanes)];
    store_.kinematics[slot / kLanes].node.set(static_cast<int>(slot % kLanes), before);
  }
  if (store_.has(Group::kFlaws)) compact_flaws();
}

// A counting sort over (tile, cell), each thread with counts of its own: it is stable. Lays out the tiles and returns
// for each of their slots, and of lone particles, the one it comes from.
template <class P>
std::vector<std::uint32_t> HostEngine<P>::order_particles(const Occupancy& occupancy,
                                                          std::span<const std::uint32_t> tile_of_block) {
  // The lowest bits of a key are those of z.
  const auto in_stack = [&](const BlockCell& cell) {
    const auto block_in_stack = static_cast<int>(occupancy.blocks()[cell.block].block % kStackBlocks);
    return CellInStack{cell.x, cell.y, cell.z + kBlockWidth * block_in_stack};
  };
  const std::vector<std::uint32_t> bounds = even_shares(store_.packs(), std::min(setup_.threads, kMostCounters));
  const std::size_t shares = bounds.size() - 1;
  CellCounts counts(stacks_.size(), shares);
  for_each_share(setup_.threads, shares, [&](std::size_t n) {
    std::uint32_t alone = 0;
    for_each_destination(bounds[n], bounds[n + 1], [&](std::size_t, const BlockCell& to) {
      const std::uint32_t t = tile_of_block[to.block];
      ++(t == kNoTile ? alone : counts.of(t, in_stack(to).index(), n));
    });
    counts.alone(n) = alone;
  });
  lay_out_tiles(counts);

  std::vector<std::uint32_t> source((lone_.first_pack + packs_for(lone_.particles)) * kLanes, ParticleStore<P>::kEmpty);
  lone_stack_.resize(lone_.particles);
  lone_node_.resize(lone_.particles);
  for_each_share(setup_.threads, shares, [&](std::size_t n) {
    std::uint32_t alone = counts.alone(n);
    for_each_destination(bounds[n], bounds[n + 1], [&](std::size_t from, const BlockCell& to) {
      const CellInStack cell = in_stack(to);
      const std::uint32_t t = tile_of_block[to.block];
      std::size_t slot = lone_.first_pack * kLanes + alone;
      if (t != kNoTile) {
        slot = counts.of(t, cell.index(), n)++;
      } else {
        lone_stack_[alone] = stack_of(block_coord(occupancy.blocks()[to.block].block));
        lone_node_[alone] = cell.packed();
        ++alone;
      }
      source[slot] = static_cast<std::uint32_t>(from);
      store_.kinematics[from / kLanes].node.set(static_cast<int>(from % kLanes), cell.packed());
    });
  });
  if (setup_.numerics.reproducible) sort_cells_by_id(source, counts);
  count_bytes(source.capacity() * sizeof(std::uint32_t) + counts.bytes());
  return source;
}

// Tiles and lone particles one after the other; of the numbers of particles become their first slots, those of lone
// particles counted from the first of them.
template <class P>
void HostEngine<P>::lay_out_tiles(CellCounts& counts) {
  tiles_.assign(stacks_.size(), Tile{});
  occupied_cells_.assign(stacks_.size(), OccupiedCells{});
  std::uint32_t packs = 0;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    tiles_[t].first_pack = packs;
    std::uint32_t slot = packs * static_cast<std::uint32_t>(kLanes);
    for (std::uint32_t c = 0; c < kStackCells; ++c) {
      const std::uint32_t before = slot;
      for (std::size_t n = 0; n < counts.shares(); ++n) slot += std::exchange(counts.of(t, c, n), slot);
      if (slot != before) occupied_cells_[t].mark(kCellsInOrder[c]);
    }
    tiles_[t].particles = slot - packs * static_cast<std::uint32_t>(kLanes);
    packs += packs_for(tiles_[t].particles);
  }
  lone_ = {packs, 0};
  for (std::size_t n = 0; n < counts.shares(); ++n) {
    lone_.particles += std::exchange(counts.alone(n), lone_.particles);
  }
}

template <class P>
void HostEngine<P>::sort_cells_by_id(std::span<std::uint32_t> source, const CellCounts& ends) const {
  // Else the order would tell from which rank a particle came.
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    std::size_t first = tiles_[t].first_pack * kLanes;
    for (std::uint32_t c = 0; c < kStackCells; ++c) {
      const std::size_t last = ends.of(t, c, ends.shares() - 1);
      const auto cell = source.subspan(first, last - first);
      if (cell.size() > 1) std::ranges::sort(cell, {}, [&](std::uint32_t slot) { return id(slot); });
      first = last;
    }
  }
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

// Sorting: every particle to the rank that owns its node, to its tile, and inside the tile to the order of its cell.
#include <algorithm>
#include <cstring>
#include <numeric>
#include <string>
#include <utility>

#include "breccia/error.hpp"
#include "grid/host_engine.hpp"
#include "mpi/message.hpp"
#include "mpi/together.hpp"

namespace breccia::grid {
namespace {

constexpr std::int32_t floor_div4(std::int32_t n) { return n >> 2; }

constexpr BlockCoord block_of(const std::int32_t (&node)[3]) {
  return {floor_div4(node[0]), floor_div4(node[1]), floor_div4(node[2])};
}

// Cells of a block in storage order: z slowest, so that consecutive particles write to different rows of nodes.
constexpr std::uint32_t cell_in_block(const std::int32_t (&node)[3]) {
  return static_cast<std::uint32_t>(((node[2] & 3) * 4 + (node[1] & 3)) * 4 + (node[0] & 3));
}

constexpr std::int32_t tile_node(const std::int32_t (&node)[3]) {
  return ((node[0] & 3) + kNodeBias) | (((node[1] & 3) + kNodeBias) << 8) | (((node[2] & 3) + kNodeBias) << 16);
}

using mpi::get;
using mpi::put;

}  // namespace

template <class P>
std::vector<Placement> HostEngine<P>::place_all() const {
  std::vector<Placement> placements;
  for_each_particle([&](std::size_t slot, BlockCoord block) {
    const std::int32_t packed = store_.kinematics[slot / kLanes].node[static_cast<int>(slot % kLanes)];
    Placement p{static_cast<std::uint32_t>(slot), {}};
    for (int axis = 0; axis < 3; ++axis) {
      const std::int32_t node = kBlockWidth * component(block, axis) + ((packed >> (8 * axis)) & 255) - kNodeBias;
      const std::int32_t wrapped = periodicity_.wrap(floor_div4(node), axis);
      if (wrapped > kBlockLimit || wrapped < -kBlockLimit) {
        throw NumericsError("particle " + std::to_string(id(slot)) + " is more than 4 million cells from the origin");
      }
      p.node[axis] = kBlockWidth * wrapped + (node & 3);
    }
    placements.push_back(p);
  });
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
  arrange(separate(std::move(placements)));
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
      const Flaws<P>& f = store_.flaws[p.slot / kLanes];
      const int lane = static_cast<int>(p.slot % kLanes);
      put(message, flaw_thresholds_.data() + f.first[lane], static_cast<std::size_t>(f.count[lane] >> 16));
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
          const auto count = static_cast<std::size_t>(f.count[static_cast<int>(lane)] >> 16);
          f.first.set(static_cast<int>(lane), static_cast<std::int32_t>(flaw_thresholds_.size()));
          flaw_thresholds_.resize(flaw_thresholds_.size() + count);
          get(from, flaw_thresholds_.data() + flaw_thresholds_.size() - count, count);
        }
        placements.push_back(p);
      }
    }
  }
}

template <class P>
void HostEngine<P>::arrange(const SortedPlacements& all) {
  // Tiles as they are met, then in the order of their keys; a counting sort over (tile, cell) is stable.
  const std::vector<Placement>& placements = all.tiled;
  blocks_.clear();
  std::vector<std::uint32_t> met(placements.size());
  for (std::size_t i = 0; i < placements.size(); ++i) met[i] = blocks_.insert(block_key(block_of(placements[i].node)));
  const std::vector<BlockKey> keys = blocks_.keys();
  std::vector<std::uint32_t> by_key(keys.size());
  std::iota(by_key.begin(), by_key.end(), 0U);
  std::sort(by_key.begin(), by_key.end(), [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  std::vector<std::uint32_t> rank(keys.size());
  for (std::uint32_t r = 0; r < by_key.size(); ++r) rank[by_key[r]] = r;

  std::vector<std::uint32_t> place(keys.size() * kBlockNodes, 0U);
  for (std::size_t i = 0; i < placements.size(); ++i) {
    ++place[rank[met[i]] * kBlockNodes + cell_in_block(placements[i].node)];
  }
  tiles_.assign(keys.size(), Tile{});
  boxes_.assign(keys.size(), kWholeTile);
  std::uint32_t packs = 0;
  for (std::uint32_t t = 0; t < tiles_.size(); ++t) {
    tiles_[t].block = t;
    tiles_[t].first_pack = packs;
    std::uint32_t slot = packs * static_cast<std::uint32_t>(kLanes);
    for (std::uint32_t c = 0; c < kBlockNodes; ++c) {
      const std::uint32_t count = std::exchange(place[t * kBlockNodes + c], slot);
      slot += count;
      tiles_[t].particles += count;
    }
    packs += packs_for(tiles_[t].particles);
  }
  lone_ = {packs, static_cast<std::uint32_t>(all.lone.size())};
  packs += packs_for(lone_.particles);

  std::vector<std::uint32_t> source(packs * kLanes, ParticleStore<P>::kEmpty);
  std::vector<std::int32_t> node(source.size(), tile_node({0, 0, 0}));
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const std::uint32_t slot = place[rank[met[i]] * kBlockNodes + cell_in_block(placements[i].node)]++;
    source[slot] = placements[i].slot;
    node[slot] = tile_node(placements[i].node);
  }
  if (setup_.numerics.reproducible) sort_cells_by_id(source, place);
  lone_block_.clear();
  lone_node_.clear();
  for (const Placement& p : all.lone) {
    const std::size_t slot = lone_.first_pack * kLanes + lone_block_.size();
    source[slot] = p.slot;
    node[slot] = tile_node(p.node);
    lone_block_.push_back(block_of(p.node));
    lone_node_.push_back(node[slot]);
  }
  lone_pull_.resize(packs_for(lone_.particles));
  store_.gather(source, setup_.threads);
  for (std::size_t s = 0; s < node.size(); ++s)
    store_.kinematics[s / kLanes].node.set(static_cast<int>(s % kLanes), node[s]);
  blocks_.clear();
  for (const std::uint32_t b : by_key) blocks_.insert(keys[b]);
  if (store_.has(Group::kFlaws)) compact_flaws();
}

template <class P>
void HostEngine<P>::sort_cells_by_id(std::span<std::uint32_t> source, std::span<const std::uint32_t> cell_ends) const {
  // Else the order would tell from which rank a particle came.
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    std::size_t first = tiles_[t].first_pack * kLanes;
    for (std::size_t c = 0; c < kBlockNodes; ++c) {
      const std::size_t last = cell_ends[t * kBlockNodes + c];
      const auto cell = source.subspan(first, last - first);
      if (cell.size() > 1) std::ranges::sort(cell, {}, [&](std::uint32_t slot) { return id(slot); });
      first = last;
    }
  }
}

template <class P>
void HostEngine<P>::compact_flaws() {
  std::size_t live = 0;
  for_each_particle([&](std::size_t slot, BlockCoord) {
    live += static_cast<std::size_t>(store_.flaws[slot / kLanes].count[static_cast<int>(slot % kLanes)] >> 16);
  });
  if (flaw_thresholds_.size() <= 2 * live) return;
  std::vector<float> kept;
  kept.reserve(live);
  for_each_particle([&](std::size_t slot, BlockCoord) {
    Flaws<P>& f = store_.flaws[slot / kLanes];
    const int lane = static_cast<int>(slot % kLanes);
    const auto first = flaw_thresholds_.begin() + f.first[lane];
    f.first.set(lane, static_cast<std::int32_t>(kept.size()));
    kept.insert(kept.end(), first, first + (f.count[lane] >> 16));
  });
  flaw_thresholds_ = std::move(kept);
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
  flaw_thresholds_ = {};
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

// After sorting: which blocks a tile reaches, which nodes are shared with other ranks, which tiles may run at once.
#include <algorithm>

#include "grid/host_engine.hpp"

namespace breccia::grid {
namespace {

// Per axis, whether a tile reaches the block below (bit 0) and above (bit 1), from the cells its particles are in:
// stencil and margin reach kTileMargin nodes further.
template <class P>
std::array<int, 3> reach(const ParticleStore<P>& store, const Tile& tile) {
  std::array<int, 3> sides{0, 0, 0};
  for (std::uint32_t n = 0; n < tile.particles; ++n) {
    const std::size_t pack = tile.first_pack + n / P::kLanes;
    const std::int32_t packed = store.kinematics[pack].node[static_cast<int>(n % P::kLanes)];
    for (int axis = 0; axis < 3; ++axis) {
      const int cell = ((packed >> (8 * axis)) & 255) - kNodeBias;
      if (cell < kTileMargin) sides[static_cast<std::size_t>(axis)] |= 1;
      if (cell >= kBlockWidth - kTileMargin) sides[static_cast<std::size_t>(axis)] |= 2;
    }
  }
  return sides;
}

bool reaches(int sides, int direction) { return direction == 0 || (sides & (direction < 0 ? 1 : 2)) != 0; }

// Calls visit(n, block) for the blocks tile reaches; n as in Tile::neighbours.
template <class P, class F>
void for_each_reached(const ParticleStore<P>& store, const Tile& tile, BlockCoord own, const Periodicity& periodicity,
                      F&& visit) {
  const std::array<int, 3> sides = reach(store, tile);
  for (int n = 0; n < 27; ++n) {
    const int d[3] = {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
    if (!reaches(sides[0], d[0]) || !reaches(sides[1], d[1]) || !reaches(sides[2], d[2])) continue;
    visit(n, periodicity.wrap({own.x + d[0], own.y + d[1], own.z + d[2]}));
  }
}

}  // namespace

template <class P>
void HostEngine<P>::connect_tiles() {
  // Owned blocks first, so that the grid update runs over a contiguous range; blocks of other ranks behind them.
  std::vector<BlockKey> foreign;
  const std::size_t tiles = tiles_.size();
  for (std::size_t t = 0; t < tiles; ++t) {
    for_each_reached(store_, tiles_[t], block_coord(blocks_.keys()[t]), periodicity_, [&](int, BlockCoord b) {
      if (owner(b) == comm_.rank()) {
        blocks_.insert(block_key(b));
      } else {
        foreign.push_back(block_key(b));
      }
    });
  }
  std::sort(foreign.begin(), foreign.end());
  foreign.erase(std::unique(foreign.begin(), foreign.end()), foreign.end());

  // Blocks that only other ranks touch must exist here before the foreign ones follow.
  std::vector<std::vector<BlockKey>> wanted(static_cast<std::size_t>(comm_.size()));
  for (const BlockKey key : foreign) wanted[static_cast<std::size_t>(owner(block_coord(key)))].push_back(key);
  for (const auto& keys : comm_.alltoall(wanted)) {
    for (const BlockKey key : keys) blocks_.insert(key);
  }
  owned_blocks_ = blocks_.size();
  for (const BlockKey key : foreign) blocks_.insert(key);
  for (std::size_t t = 0; t < tiles; ++t) {
    std::fill(std::begin(tiles_[t].neighbours), std::end(tiles_[t].neighbours), kNoBlock);
    for_each_reached(store_, tiles_[t], block_coord(blocks_.keys()[t]), periodicity_,
                     [&](int n, BlockCoord b) { tiles_[t].neighbours[n] = blocks_.find(block_key(b)); });
  }
  // The grid update has cleared every sum. Old velocities stay where they are: only nodes that a scatter has reached
  // since are read.
  const std::size_t nodes = blocks_.size() * kBlockNodes * kChannels;
  if (nodes > sums_.capacity()) {
    // Some room for the next sortings, not twice as much as push_back would take.
    sums_.reserve(nodes + nodes / 16);
    velocities_.reserve(nodes + nodes / 16);
  }
  sums_.resize(nodes, Real(0));
  velocities_.resize(nodes, Real(0));
  rows_.assign(blocks_.size(), RowMask{});
  boundaries_.find_nodes(std::span(blocks_.keys()).first(owned_blocks_));
}

template <class P>
void HostEngine<P>::connect_halo() {
  // Which planes of a foreign block are touched: only those travel.
  struct Request {
    BlockKey key;
    std::uint32_t planes;
  };
  const int axis = slabs_.axis();
  const int step = axis == 0 ? 9 : axis == 1 ? 3 : 1;
  std::vector<std::uint32_t> planes(blocks_.size() - owned_blocks_, 0U);
  for (const Tile& tile : tiles_) {
    for (int n = 0; n < 27; ++n) {
      const std::uint32_t b = tile.neighbours[n];
      if (b == kNoBlock || b < owned_blocks_) continue;
      const int direction = n / step % 3 - 1;
      planes[b - owned_blocks_] |= direction < 0 ? 0b1100U : direction > 0 ? 0b0011U : 0b1111U;
    }
  }
  std::vector<std::vector<Request>> requests(static_cast<std::size_t>(comm_.size()));
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const BlockKey key = blocks_.keys()[owned_blocks_ + i];
    requests[static_cast<std::size_t>(owner(block_coord(key)))].push_back({key, planes[i]});
  }
  const auto nodes_of = [&](const std::vector<std::vector<Request>>& all) {
    std::vector<mpi::SharedNodes> peers;
    for (std::size_t rank = 0; rank < all.size(); ++rank) {
      if (all[rank].empty()) continue;
      mpi::SharedNodes peer{static_cast<int>(rank), {}};
      for (const Request& request : all[rank]) {
        const std::uint32_t block = blocks_.find(request.key);
        for (std::uint32_t n = 0; n < kBlockNodes; ++n) {
          const std::uint32_t plane = axis == 0 ? n / 16 : axis == 1 ? n / 4 % 4 : n % 4;
          if ((request.planes >> plane & 1U) != 0) peer.nodes.push_back(block * kBlockNodes + n);
        }
      }
      peers.push_back(std::move(peer));
    }
    return peers;
  };
  auto touched = nodes_of(requests);
  const auto asked = comm_.alltoall(requests);
  shared_blocks_.clear();
  for (const std::vector<Request>& of_rank : asked) {
    for (const Request& request : of_rank) shared_blocks_.push_back(blocks_.find(request.key));
  }
  is_shared_.assign(blocks_.size(), 0);
  for (const std::uint32_t block : shared_blocks_) is_shared_[block] = 1;
  halo_.set(std::move(touched), nodes_of(asked));
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

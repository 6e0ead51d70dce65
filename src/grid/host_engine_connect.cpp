// After sorting: which blocks a tile reaches, which nodes are shared with other ranks, which tiles are of the boundary.
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

// One request for each block, in the order of their keys.
void merge(std::vector<BlockRequest>& requests) {
  std::sort(requests.begin(), requests.end(), [](const auto& a, const auto& b) { return a.key < b.key; });
  std::vector<BlockRequest> merged;
  for (const BlockRequest& request : requests) {
    if (merged.empty() || merged.back().key != request.key) {
      merged.push_back(request);
    } else {
      merged.back().planes |= request.planes;
    }
  }
  requests = std::move(merged);
}

}  // namespace

template <class P>
std::vector<std::vector<BlockRequest>> HostEngine<P>::reach_blocks() {
  const int axis = slabs_.axis();
  const int stride = axis == 0 ? 9 : axis == 1 ? 3 : 1;
  std::vector<std::vector<BlockRequest>> of_rank(static_cast<std::size_t>(comm_.size()));
  const std::size_t tiles = tiles_.size();
  for (std::size_t t = 0; t < tiles; ++t) {
    const BlockCoord own = block_coord(blocks_.keys()[t]);
    for_each_reached(store_, tiles_[t], own, periodicity_, [&](int n, BlockCoord b) {
      const std::uint32_t mine = own_planes(b);
      if (mine != 0) blocks_.insert(block_key(b));
      const std::uint32_t foreign = reached_planes(own, n / stride % 3 - 1) & ~mine;
      for (std::int32_t plane = 0; plane < kBlockWidth; ++plane) {
        if ((foreign >> plane & 1U) == 0) continue;
        of_rank[static_cast<std::size_t>(slabs_.owner(first_plane(b) + plane))].push_back({block_key(b), 1U << plane});
      }
    });
  }
  for (std::vector<BlockRequest>& requests : of_rank) merge(requests);
  return of_rank;
}

template <class P>
std::uint32_t HostEngine<P>::reached_planes(BlockCoord own, int direction) const {
  // Particles of this rank are nearest to its planes, and reach kTileMargin further.
  const auto rank = static_cast<std::size_t>(comm_.rank());
  const std::vector<std::int32_t>& cuts = slabs_.cuts();
  std::uint32_t planes = direction < 0 ? 0b1100U : direction > 0 ? 0b0011U : 0b1111U;
  for (std::int32_t n = 0; n < kBlockWidth; ++n) {
    const std::int64_t plane = first_plane(own) + kBlockWidth * direction + n;
    const bool below = rank > 0 && plane < std::int64_t{cuts[rank - 1]} - kTileMargin;
    const bool above = rank < cuts.size() && plane >= std::int64_t{cuts[rank]} + kTileMargin;
    if (below || above) planes &= ~(1U << n);
  }
  return planes;
}

template <class P>
void HostEngine<P>::connect_tiles() {
  // Blocks with nodes of this rank first, so that the grid update runs over a contiguous range; blocks of other ranks
  // behind them. In a block that a cut divides the update runs over the nodes of others, too: their sums have left, and
  // their velocities come.
  block_requests_.ask(reach_blocks(), comm_);
  // Blocks that only other ranks touch must exist here, too.
  for (const auto& requests : block_requests_.by_rank()) {
    for (const BlockRequest& request : requests) blocks_.insert(request.key);
  }
  owned_blocks_ = blocks_.size();
  for (const auto& requests : block_requests_.of_rank()) {
    for (const BlockRequest& request : requests) blocks_.insert(request.key);
  }
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    std::fill(std::begin(tiles_[t].neighbours), std::end(tiles_[t].neighbours), kNoBlock);
    for_each_reached(store_, tiles_[t], block_coord(blocks_.keys()[t]), periodicity_,
                     [&](int n, BlockCoord b) { tiles_[t].neighbours[n] = blocks_.find(block_key(b)); });
  }
  connect_halo();
  make_room();
  sweep_ =
      plan_sweep(std::span(blocks_.keys()).first(tiles_.size()), is_boundary_, periodicity_.blocks[0], setup_.threads);
  boundaries_.find_nodes(std::span(blocks_.keys()).first(owned_blocks_),
                         [&](std::uint32_t b) { return block_sums_[b] == BlockSums::kShared; });
}

template <class P>
void HostEngine<P>::make_room() {
  // The grid update has cleared every sum. Old velocities stay where they are: only nodes that a scatter has reached
  // since are read.
  const std::size_t blocks = std::max(blocks_.size(), ordered_.blocks());
  const auto grow = [](LargeArray<Real>& array, std::size_t of_blocks) {
    const std::size_t nodes = of_blocks * kBlockNodes * kChannels;
    // Some room for the next sortings, not twice as much as push_back would take.
    if (nodes > array.capacity()) array.reserve(nodes + nodes / 16);
    array.resize(nodes, Real(0));
  };
  grow(sums_, blocks);
  grow(velocities_, blocks_.size());
  rows_.assign(blocks, RowMask{});
}

template <class P>
void HostEngine<P>::connect_halo() {
  block_sums_.assign(owned_blocks_, BlockSums::kInPlace);
  is_boundary_.assign(tiles_.size(), 0);
  if (comm_.size() == 1) return;
  for (const auto* of_all : {&block_requests_.by_rank(), &block_requests_.of_rank()}) {
    for (const std::vector<BlockRequest>& requests : *of_all) {
      for (const BlockRequest& request : requests) {
        const std::uint32_t block = blocks_.find(request.key);
        if (block < owned_blocks_) block_sums_[block] = BlockSums::kShared;
      }
    }
  }
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    for (const std::uint32_t b : tiles_[t].neighbours) {
      if (b != kNoBlock && (b >= owned_blocks_ || block_sums_[b] == BlockSums::kShared)) is_boundary_[t] = 1;
    }
  }
  auto touched = nodes_of(block_requests_.of_rank());
  auto owned = nodes_of(block_requests_.by_rank());
  if (setup_.numerics.reproducible) {
    // What boundary tiles reach gets its sums in another order than on one rank.
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      for (const std::uint32_t b : tiles_[t].neighbours) {
        if (is_boundary_[t] != 0 && b < owned_blocks_ && block_sums_[b] == BlockSums::kInPlace) {
          block_sums_[b] = BlockSums::kCollected;
        }
      }
    }
    ContributionMessages messages = ordered_.connect(
        tiles_, blocks_, block_sums_, periodicity_.blocks[0], [&](BlockCoord b) { return slabs_.owner(first_plane(b)); }, comm_);
    sum_exchange_.set(std::move(messages.sent), std::move(messages.received), comm_);
  } else {
    sum_exchange_.set(touched, owned, comm_);
  }
  velocity_exchange_.set(std::move(owned), std::move(touched), comm_);
}

template <class P>
std::vector<mpi::SharedNodes> HostEngine<P>::nodes_of(const std::vector<std::vector<BlockRequest>>& requests) const {
  const int axis = slabs_.axis();
  std::vector<mpi::SharedNodes> peers;
  for (std::size_t rank = 0; rank < requests.size(); ++rank) {
    if (requests[rank].empty()) continue;
    mpi::SharedNodes peer{static_cast<int>(rank), {}};
    for (const BlockRequest& request : requests[rank]) {
      const std::uint32_t block = blocks_.find(request.key);
      for (std::uint32_t n = 0; n < kBlockNodes; ++n) {
        const std::uint32_t plane = axis == 0 ? n / 16 : axis == 1 ? n / 4 % 4 : n % 4;
        if ((request.planes >> plane & 1U) != 0) peer.nodes.push_back(block * kBlockNodes + n);
      }
    }
    peers.push_back(std::move(peer));
  }
  return peers;
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

// After sorting: which blocks a tile reaches, which nodes are shared with other ranks, which tiles are of the boundary.
#include <algorithm>
#include <bit>

#include "grid/host_engine.hpp"

namespace breccia::grid {
namespace {

// Which of the blocks along an axis a tile reaches, from the cells its particles are in: stencil and margin reach
// kTileMargin nodes further. Bit 0 for the block below the stack.
unsigned reached_blocks(unsigned cells, int blocks_of_stack) {
  unsigned reached = 0;
  for (int slot = 0; slot < blocks_of_stack + 2; ++slot) {
    const int first = kBlockWidth * (slot - 1) - kTileMargin;  // cells from which a node of the block is reached
    const int last = first + kBlockWidth + 2 * kTileMargin - 1;
    const unsigned from = (2U << last) - (1U << std::max(first, 0));
    if ((cells & from) != 0) reached |= 1U << slot;
  }
  // Columns of a tile have no gaps.
  return (1U << std::bit_width(reached)) - (1U << std::countr_zero(reached));
}

BlockCoord neighbour(BlockKey stack, int n) {
  const BlockCoord own = block_coord(stack);
  const BlockCoord d = neighbour_offset(n);
  return {own.x + d.x, own.y + d.y, own.z + d.z};
}

// Calls visit(n, block) for the blocks of the box that a tile reaches; n as in Tile::neighbours, `block` not wrapped.
template <class F>
void for_each_reached(const OccupiedCells& cells, BlockKey stack, F&& visit) {
  const unsigned reached[3] = {reached_blocks(cells.axis[0], 1), reached_blocks(cells.axis[1], 1),
                               reached_blocks(cells.axis[2], kStackBlocks)};
  for (int n = 0; n < kNeighbours; ++n) {
    const BlockCoord d = neighbour_offset(n);
    const bool hit = (reached[0] >> (d.x + 1) & reached[1] >> (d.y + 1) & reached[2] >> (d.z + 1) & 1U) != 0;
    if (hit) visit(n, neighbour(stack, n));
  }
}

// Of each block, n as in Tile::neighbours, the planes across `axis` with nodes that particles of the tile reach: what
// another rank has to know of. Fewer than the box around the tile where matter thins out towards a cut.
template <class P>
std::array<std::uint32_t, kNeighbours> reached_planes(const ParticleStore<P>& store, const Tile& tile, int axis) {
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  std::array<std::uint32_t, kNeighbours> planes{};
  for (std::uint32_t i = 0; i < tile.particles; ++i) {
    const std::int32_t packed = store.kinematics[tile.first_pack + i / P::kLanes].node[static_cast<int>(i % P::kLanes)];
    const auto node = [&](int of_axis) { return ((packed >> (8 * of_axis)) & 255) - kNodeBias; };
    // The block that holds a node so far from the particle's, from the lowest of the stack.
    const auto block = [&](int of_axis, int away) { return (node(of_axis) + away) >> 2; };
    for (int away = -kTileMargin; away <= kTileMargin; ++away) {
      const std::uint32_t plane = 1U << ((node(axis) + away) & (kBlockWidth - 1));
      for (const int a : {block(u, -kTileMargin), block(u, kTileMargin)}) {
        for (const int b : {block(v, -kTileMargin), block(v, kTileMargin)}) {
          int at[3];
          at[axis] = block(axis, away);
          at[u] = a;
          at[v] = b;
          planes[static_cast<std::size_t>(neighbour_at({at[0], at[1], at[2]}))] |= plane;
        }
      }
    }
  }
  return planes;
}

// Where stencils of the particles may begin: all their nodes lie in blocks that are reached.
TileBox reached_starts(const OccupiedCells& cells) {
  TileBox starts{};
  for (int axis = 0; axis < 3; ++axis) {
    const unsigned reached = reached_blocks(cells.axis[axis], axis == 2 ? kStackBlocks : 1);
    const auto first_node = [](int slot) { return kBlockWidth * (slot - 1) + kTileMargin; };
    const int low = std::max(first_node(std::countr_zero(reached)), 0);
    const int high = std::min(first_node(std::bit_width(reached)), tile_extent(axis)) - 3;
    starts.low[axis] = static_cast<std::int8_t>(low);
    starts.high[axis] = static_cast<std::int8_t>(high);
  }
  return starts;
}

// Of blocks that share their columns all are collected if one is not added to in place: a tile adds to whole columns.
void collect_whole_columns(const NodeColumns& columns, std::span<BlockSums> owned) {
  columns.for_each_run([&](std::span<const std::uint32_t> run) {
    const auto in_place = [&](std::uint32_t b) { return b < owned.size() && owned[b] == BlockSums::kInPlace; };
    if (std::ranges::all_of(run, in_place)) return;
    for (const std::uint32_t b : run) {
      if (in_place(b)) owned[b] = BlockSums::kCollected;
    }
  });
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
  std::vector<std::vector<BlockRequest>> of_rank(static_cast<std::size_t>(comm_.size()));
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    bool all_mine = true;
    std::fill(std::begin(tiles_[t].neighbours), std::end(tiles_[t].neighbours), kNoBlock);
    std::array<std::uint32_t, kNeighbours> planes{};
    for_each_reached(occupied_cells_[t], stacks_[t], [&](int n, BlockCoord there) {
      const BlockCoord b = stored(there);
      const std::uint32_t mine = own_planes(b);
      if (mine != 0) tiles_[t].neighbours[n] = insert_owned(b);
      all_mine = all_mine && mine == kAllPlanes;
      planes[static_cast<std::size_t>(n)] = planes_in_reach(neighbour_offset(n), axis);
    });
    if (all_mine) continue;
    // Ordered sums are told for each tile, and all of its box.
    if (!setup_.numerics.reproducible) planes = reached_planes(store_, tiles_[t], axis);
    for (int n = 0; n < kNeighbours; ++n) {
      const BlockCoord b = stored(neighbour(stacks_[t], n));
      const std::uint32_t foreign = planes[static_cast<std::size_t>(n)] & ~own_planes(b);
      for (std::int32_t plane = 0; plane < kBlockWidth; ++plane) {
        if ((foreign >> plane & 1U) == 0) continue;
        of_rank[static_cast<std::size_t>(slabs_.owner(first_plane(periodicity_.wrap(b)) + plane))].push_back(
            {block_key(b), 1U << plane});
      }
    }
  }
  for (std::vector<BlockRequest>& requests : of_rank) merge(requests);
  return of_rank;
}

template <class P>
BlockCoord HostEngine<P>::stored(BlockCoord block) const {
  // Columns of blocks go on beyond the period.
  const BlockCoord wrapped = periodicity_.wrap(block);
  return {wrapped.x, wrapped.y, block.z};
}

template <class P>
std::uint32_t HostEngine<P>::insert_owned(BlockCoord stored_block) {
  const std::uint32_t block = blocks_.insert(block_key(stored_block));
  const BlockCoord original = periodicity_.wrap(stored_block);
  if (original != stored_block) blocks_.insert(block_key(original));
  return block;
}

template <class P>
void HostEngine<P>::insert_stacks() {
  blocks_.clear();
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    tiles_[t].first_block = static_cast<std::uint32_t>(blocks_.size());
    for_each_reached(occupied_cells_[t], stacks_[t], [&](int, BlockCoord b) {
      const bool of_stack = stack_of(b) == block_coord(stacks_[t]);
      if (of_stack && periodicity_.wrap(b) == b && own_planes(b) != 0) blocks_.insert(block_key(b));
    });
    tiles_[t].last_block = static_cast<std::uint32_t>(blocks_.size());
  }
}

template <class P>
void HostEngine<P>::connect_tiles() {
  // Blocks with nodes of this rank first, so that the grid update runs over a contiguous range, and of these the stacks
  // of the tiles; blocks of other ranks behind them. In a block that a cut divides the update runs over the nodes of
  // others, too: their sums have left, and their velocities come.
  insert_stacks();
  block_requests_.ask(reach_blocks(), comm_);
  // Blocks that only other ranks touch must exist here, too.
  for (const auto& requests : block_requests_.by_rank()) {
    for (const BlockRequest& request : requests) insert_owned(block_coord(request.key));
  }
  owned_blocks_ = blocks_.size();
  for (const auto& requests : block_requests_.of_rank()) {
    for (const BlockRequest& request : requests) blocks_.insert(request.key);
  }
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    for_each_reached(occupied_cells_[t], stacks_[t], [&](int n, BlockCoord b) {
      if (tiles_[t].neighbours[n] == kNoBlock) tiles_[t].neighbours[n] = blocks_.insert(block_key(stored(b)));
    });
  }
  columns_.lay_out(blocks_.keys());
  node_places_ = columns_.places();
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    tiles_[t].starts = reached_starts(occupied_cells_[t]);
    set_columns(tiles_[t], columns_.blocks());
  }
  connect_halo();
  rows_.assign(columns_.blocks().size(), RowMask{});
  if (!has_few_nodes()) hold_velocities();
  sweep_ = plan_sweep(sweep_tiles(), periodicity_.blocks[0], setup_.threads);
  const auto is_shared = [&](std::uint32_t b) { return block_sums_[b] == BlockSums::kShared; };
  images_.find(blocks_, owned_blocks_, periodicity_, [&](const auto& image) { return is_shared(image.block); });
  boundaries_.find_nodes(
      std::span(blocks_.keys()).first(owned_blocks_),
      [&](std::uint32_t b, std::uint32_t n) {
        return std::size_t{velocity_half(columns_.blocks()[b].node(n), 0)} * kVelocityChannels;
      },
      is_shared);
}

template <class P>
void HostEngine<P>::connect_halo() {
  block_sums_.assign(owned_blocks_, BlockSums::kInPlace);
  is_boundary_.assign(tiles_.size(), 0);
  boundary_node_.clear();
  if (comm_.size() == 1) return;
  for (const auto* of_all : {&block_requests_.by_rank(), &block_requests_.of_rank()}) {
    for (const std::vector<BlockRequest>& requests : *of_all) {
      for (const BlockRequest& request : requests) {
        const std::uint32_t block = blocks_.find(request.key);
        if (block < owned_blocks_) block_sums_[block] = BlockSums::kShared;
      }
    }
  }
  share_with_images();
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    for (const std::uint32_t b : tiles_[t].neighbours) {
      if (b != kNoBlock && (b >= owned_blocks_ || block_sums_[b] == BlockSums::kShared)) is_boundary_[t] = 1;
    }
  }
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    for (std::uint32_t n = 0; is_boundary_[t] != 0 && n < tiles_[t].particles; ++n) {
      const std::size_t slot = tiles_[t].first_pack * kLanes + n;
      boundary_node_.push_back(store_.kinematics[slot / kLanes].node[static_cast<int>(slot % kLanes)]);
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
    collect_whole_columns(columns_, block_sums_);
    ContributionMessages messages = ordered_.connect(
        tiles_, stacks_, blocks_, columns_, block_sums_, periodicity_.blocks[0],
        [&](BlockCoord b) { return slabs_.owner(first_plane(periodicity_.wrap(b))); }, comm_);
    sum_exchange_.set(std::move(messages.sent), std::move(messages.received), comm_);
  } else {
    sum_exchange_.set(touched, owned, comm_);
  }
  velocity_exchange_.set(velocity_halves_of(owned), velocity_halves_of(touched), comm_);
}

// The sums of an image and of its original are added up at the same time.
template <class P>
void HostEngine<P>::share_with_images() {
  images_.find(blocks_, owned_blocks_, periodicity_, [](const auto&) { return false; });
  const auto share = [&](std::uint32_t from, std::uint32_t to) {
    if (block_sums_[from] == BlockSums::kShared) block_sums_[to] = BlockSums::kShared;
  };
  for (const PeriodImages::Image& image : images_.rest()) share(image.block, image.original);
  for (const PeriodImages::Image& image : images_.rest()) share(image.original, image.block);
}

template <class P>
std::vector<mpi::SharedNodes> HostEngine<P>::velocity_halves_of(const std::vector<mpi::SharedNodes>& peers) const {
  std::vector<mpi::SharedNodes> halves = peers;
  for (mpi::SharedNodes& peer : halves) {
    const std::vector<std::uint32_t> nodes = std::move(peer.nodes);
    peer.nodes.clear();
    for (const std::uint32_t node : nodes) {
      for (std::uint32_t h = 0; h < 2; ++h) peer.nodes.push_back(velocity_half(node, h));
    }
  }
  return halves;
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
        if ((request.planes >> plane & 1U) != 0) peer.nodes.push_back(columns_.blocks()[block].node(n));
      }
    }
    peers.push_back(std::move(peer));
  }
  return peers;
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

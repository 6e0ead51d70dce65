#include "cuda/check.hpp"
#include "cuda/launchers.hpp"
#include "cuda/sort_kernels.hpp"

namespace breccia::cuda {
namespace {

using grid::BlockCoord;
using grid::BlockKey;
using grid::kBlockWidth;

constexpr unsigned kThreads = 256;

BRECCIA_HD unsigned thread_in_grid(unsigned block, unsigned thread) { return block * kThreads + thread; }

/// Coordinate of the nearest node relative to the tile's block.
BRECCIA_HD int cell_of(std::int32_t node, int axis) { return (node >> (8 * axis) & 255) - grid::kNodeBias; }

BRECCIA_HD BlockKey neighbour_key(BlockCoord b, int n, const grid::Periodicity& periodicity) {
  return grid::block_key(periodicity.wrap(BlockCoord{b.x + n / 9 - 1, b.y + n / 3 % 3 - 1, b.z + n % 3 - 1}));
}

// --- where particles are --------------------------------------------------------------------------------------------

struct PlaceShared {
  PlaceReport report;
};

__global__ void place(std::int32_t* node, BlockKey* keys, std::uint64_t* cells, unsigned* order, unsigned count,
                      grid::Periodicity periodicity, PlaceReport* report) {
  BRECCIA_SHARED(PlaceShared, shared);
  if (threadIdx.x == 0) shared.report = {};
  __syncthreads();
  for (unsigned i = thread_in_grid(blockIdx.x, threadIdx.x); i < count; i += kThreads * gridDim.x) {
    const BlockCoord old = grid::block_coord(keys[i]);
    const std::int32_t packed = node[i];
    const int corner[3] = {old.x, old.y, old.z};
    int block[3];
    int cell[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int at = kBlockWidth * corner[axis] + cell_of(packed, axis);
      block[axis] = periodicity.wrap(at >> 2, axis);
      cell[axis] = at & 3;
      if (block[axis] > grid::kBlockLimit || block[axis] < -grid::kBlockLimit) atomicAdd(&shared.report.too_far, 1U);
      atomicMax(&shared.report.highest[axis], grid::kBlockLimit + block[axis]);
      atomicMax(&shared.report.lowest[axis], grid::kBlockLimit - block[axis]);
    }
    keys[i] = grid::block_key({block[0], block[1], block[2]});
    node[i] = (cell[0] + grid::kNodeBias) | (cell[1] + grid::kNodeBias) << 8 | (cell[2] + grid::kNodeBias) << 16;
    cells[i] = static_cast<std::uint64_t>((cell[2] * 4 + cell[1]) * 4 + cell[0]);
    order[i] = i;
  }
  __syncthreads();
  if (threadIdx.x < 3) {
    atomicMax(&report->highest[threadIdx.x], shared.report.highest[threadIdx.x]);
    atomicMax(&report->lowest[threadIdx.x], shared.report.lowest[threadIdx.x]);
  }
  if (threadIdx.x == 0 && shared.report.too_far != 0) atomicAdd(&report->too_far, shared.report.too_far);
}

__global__ void compact_keys(const BlockKey* keys, const unsigned* order, std::uint64_t* compact, unsigned count,
                             CompactKeys layout) {
  const unsigned i = thread_in_grid(blockIdx.x, threadIdx.x);
  if (i >= count) return;
  const BlockCoord b = grid::block_coord(keys[order[i]]);
  const auto x = static_cast<std::uint64_t>(b.x - layout.corner.x);
  const auto y = static_cast<std::uint64_t>(b.y - layout.corner.y);
  const auto z = static_cast<std::uint64_t>(b.z - layout.corner.z);
  compact[i] = (x << layout.bits[1] | y) << layout.bits[2] | z;
}

// --- runs of particles in one block ---------------------------------------------------------------------------------

__global__ void mark_runs(const std::uint64_t* compact, unsigned* starts, unsigned count) {
  const unsigned i = thread_in_grid(blockIdx.x, threadIdx.x);
  if (i > count) return;
  starts[i] = i == 0 || i == count || compact[i] != compact[i - 1] ? 1U : 0U;
}

__global__ void list_runs(const BlockKey* keys, const unsigned* order, Runs runs) {
  const unsigned i = thread_in_grid(blockIdx.x, threadIdx.x);
  if (i > runs.particles) return;
  if (i == runs.particles) {
    runs.first[runs.count] = i;
    return;
  }
  const unsigned run = runs.of[i];
  if (runs.of[i + 1] == run) return;  // does not start one
  runs.first[run] = i;
  runs.key[run] = keys[order[i]];
}

__global__ void insert_all(const BlockKey* keys, unsigned count, BlockHash hash) {
  const unsigned i = thread_in_grid(blockIdx.x, threadIdx.x);
  if (i >= count) return;
  bool is_new = false;
  const unsigned slot = insert(hash, keys[i], is_new);
  hash.indices[slot] = i;
}

// Stencils touch when nearest nodes differ by at most 2 along every axis, and each particle may drift one node until
// the next sorting.
constexpr int kReach = 2 + 2;

__device__ __forceinline__ bool is_alone(const Runs& runs, unsigned run, const BlockHash& hash,
                                         const std::int32_t* node, const unsigned* order,
                                         const grid::Periodicity& periodicity, const OwnPlanes& planes) {
  const BlockCoord own = grid::block_coord(runs.key[run]);
  for (int side = -1; side <= 1; ++side) {
    const std::int32_t plane = periodicity.wrap(grid::component(own, planes.axis) + side, planes.axis);
    if (plane < planes.low || plane >= planes.high) return false;
  }
  const std::int32_t here = node[order[runs.first[run]]];
  for (int n = 0; n < 27; ++n) {
    if (n == 13) continue;
    const unsigned other = find(hash, neighbour_key(own, n, periodicity));
    if (other == grid::kNoBlock) continue;
    if (runs.first[other + 1] - runs.first[other] > 1) return false;
    const std::int32_t there = node[order[runs.first[other]]];
    const int direction[3] = {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
    bool near = true;
    for (int axis = 0; axis < 3; ++axis) {
      const int apart = kBlockWidth * direction[axis] + cell_of(there, axis) - cell_of(here, axis);
      near = near && apart <= kReach && apart >= -kReach;
    }
    if (near) return false;
  }
  return true;
}

__global__ void separate(Runs runs, BlockHash hash, const std::int32_t* node, const unsigned* order,
                         grid::Periodicity periodicity, OwnPlanes planes, bool lone_without_grid) {
  const unsigned run = thread_in_grid(blockIdx.x, threadIdx.x);
  if (run > runs.count) return;
  if (run == runs.count) {
    runs.tiles[run] = runs.tiled[run] = 0;
    return;
  }
  const unsigned particles = runs.first[run + 1] - runs.first[run];
  const bool lone = lone_without_grid && particles == 1 && is_alone(runs, run, hash, node, order, periodicity, planes);
  runs.tiles[run] = lone ? 0U : 1U;
  runs.tiled[run] = lone ? 0U : particles;
}

// --- the new order --------------------------------------------------------------------------------------------------

BRECCIA_HD bool is_tile(const Runs& runs, unsigned run) { return runs.tiles[run + 1] != runs.tiles[run]; }

__global__ void arrange(Runs runs, const unsigned* order, unsigned tiled_particles, unsigned* source,
                        BlockKey* key_of_slot) {
  const unsigned i = thread_in_grid(blockIdx.x, threadIdx.x);
  if (i >= runs.particles) return;
  const unsigned run = runs.of[i + 1] - 1;
  const unsigned slot =
      is_tile(runs, run) ? runs.tiled[run] + i - runs.first[run] : tiled_particles + run - runs.tiles[run];
  source[slot] = order[i];
  key_of_slot[slot] = runs.key[run];
}

__global__ void list_tiles(Runs runs, unsigned tiles, unsigned* tile_first, BlockKey* block_keys) {
  const unsigned run = thread_in_grid(blockIdx.x, threadIdx.x);
  if (run > runs.count) return;
  if (run == runs.count) {
    tile_first[tiles] = runs.tiled[run];
  } else if (is_tile(runs, run)) {
    tile_first[runs.tiles[run]] = runs.tiled[run];
    block_keys[runs.tiles[run]] = runs.key[run];
  }
}

template <class Word>
__global__ void gather(Planes planes, const unsigned* source, unsigned count) {
  const unsigned i = thread_in_grid(blockIdx.x, threadIdx.x);
  if (i >= count) return;
  const unsigned from = source == nullptr ? i : source[i];
  BRECCIA_UNROLL(8)  // an index that is known: the list stays where the launch put it
  for (int c = 0; c < Planes::kMost; ++c) {
    if (c >= planes.count) break;
    static_cast<Word*>(planes.to[c])[i] = static_cast<const Word*>(planes.from[c])[from];
  }
}

// --- blocks ---------------------------------------------------------------------------------------------------------

constexpr unsigned kReachThreads = 64;

struct ReachShared {
  unsigned sides;  // bit 2 axis: reaches the block below, bit 2 axis + 1: above
};

// From the cells its particles are in: stencil and margin reach kTileMargin nodes further.
BRECCIA_HD unsigned sides_of(std::int32_t node) {
  unsigned sides = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int cell = cell_of(node, axis);
    if (cell < grid::kTileMargin) sides |= 1U << (2 * axis);
    if (cell >= kBlockWidth - grid::kTileMargin) sides |= 2U << (2 * axis);
  }
  return sides;
}
BRECCIA_HD bool reaches(unsigned sides, int axis, int direction) {
  return direction == 0 || (sides >> (2 * axis) & (direction < 0 ? 1U : 2U)) != 0;
}

__global__ void reach(const unsigned* tile_first, const std::int32_t* node, grid::Periodicity periodicity,
                      BlockHash hash, BlockKey* block_keys, unsigned* block_count) {
  BRECCIA_SHARED(ReachShared, shared);
  const unsigned tile = blockIdx.x;
  if (threadIdx.x == 0) shared.sides = 0;
  __syncthreads();
  unsigned sides = 0;
  for (unsigned i = tile_first[tile] + threadIdx.x; i < tile_first[tile + 1]; i += kReachThreads) {
    sides |= sides_of(node[i]);
  }
  atomicOr(&shared.sides, sides);
  __syncthreads();
  const int n = static_cast<int>(threadIdx.x);
  if (n >= 27 || n == 13) return;
  sides = shared.sides;
  if (!reaches(sides, 0, n / 9 - 1) || !reaches(sides, 1, n / 3 % 3 - 1) || !reaches(sides, 2, n % 3 - 1)) return;
  const BlockKey key = neighbour_key(grid::block_coord(block_keys[tile]), n, periodicity);
  bool is_new = false;
  const unsigned slot = insert(hash, key, is_new);
  if (!is_new) return;
  const unsigned block = atomicAdd(block_count, 1U);
  hash.indices[slot] = block;
  block_keys[block] = key;
}

__global__ void find_neighbours(const BlockKey* block_keys, unsigned blocks, grid::Periodicity periodicity,
                                BlockHash hash, unsigned* neighbours) {
  const unsigned i = thread_in_grid(blockIdx.x, threadIdx.x);
  if (i >= blocks * 27) return;
  neighbours[i] =
      find(hash, neighbour_key(grid::block_coord(block_keys[i / 27]), static_cast<int>(i % 27), periodicity));
}

__global__ void lone_drift(const std::int32_t* node, const std::int32_t* node_then, unsigned count, unsigned* strayed) {
  const unsigned i = thread_in_grid(blockIdx.x, threadIdx.x);
  if (i >= count) return;
  for (int axis = 0; axis < 3; ++axis) {
    const int drift = cell_of(node[i], axis) - cell_of(node_then[i], axis);
    if (drift < -1 || drift > 1) atomicAdd(strayed, 1U);
  }
}

dim3 grid_for(unsigned items) { return {blocks_for(items, kThreads)}; }
void launched() { check(cudaGetLastError(), "launch of a sorting kernel"); }

}  // namespace

void launch_place(std::int32_t* node, BlockKey* keys, std::uint64_t* cells, unsigned* order, unsigned count,
                  const grid::Periodicity& periodicity, PlaceReport* report, cudaStream_t stream) {
  constexpr unsigned most = 1024;
  const unsigned blocks = blocks_for(count, kThreads);
  BRECCIA_LAUNCH(place, dim3(blocks < most ? blocks : most), dim3(kThreads), sizeof(PlaceShared), stream, node, keys,
                 cells, order, count, periodicity, report);
  launched();
}

void launch_compact_keys(const BlockKey* keys, const unsigned* order, std::uint64_t* compact, unsigned count,
                         const CompactKeys& layout, cudaStream_t stream) {
  BRECCIA_LAUNCH(compact_keys, grid_for(count), dim3(kThreads), 0, stream, keys, order, compact, count, layout);
  launched();
}

void launch_mark_runs(const std::uint64_t* compact, unsigned* starts, unsigned count, cudaStream_t stream) {
  BRECCIA_LAUNCH(mark_runs, grid_for(count + 1), dim3(kThreads), 0, stream, compact, starts, count);
  launched();
}

void launch_list_runs(const BlockKey* keys, const unsigned* order, const Runs& runs, cudaStream_t stream) {
  BRECCIA_LAUNCH(list_runs, grid_for(runs.particles + 1), dim3(kThreads), 0, stream, keys, order, runs);
  launched();
}

void launch_insert_all(const BlockKey* keys, unsigned count, const BlockHash& hash, cudaStream_t stream) {
  if (count == 0) return;
  BRECCIA_LAUNCH(insert_all, grid_for(count), dim3(kThreads), 0, stream, keys, count, hash);
  launched();
}

void launch_separate(const Runs& runs, const BlockHash& hash, const std::int32_t* node, const unsigned* order,
                     const grid::Periodicity& periodicity, const OwnPlanes& planes, bool lone_without_grid,
                     cudaStream_t stream) {
  BRECCIA_LAUNCH(separate, grid_for(runs.count + 1), dim3(kThreads), 0, stream, runs, hash, node, order, periodicity,
                 planes, lone_without_grid);
  launched();
}

void launch_arrange(const Runs& runs, const unsigned* order, unsigned tiled_particles, unsigned* source,
                    BlockKey* key_of_slot, cudaStream_t stream) {
  BRECCIA_LAUNCH(arrange, grid_for(runs.particles), dim3(kThreads), 0, stream, runs, order, tiled_particles, source,
                 key_of_slot);
  launched();
}

void launch_list_tiles(const Runs& runs, unsigned tiles, unsigned* tile_first, BlockKey* block_keys,
                       cudaStream_t stream) {
  BRECCIA_LAUNCH(list_tiles, grid_for(runs.count + 1), dim3(kThreads), 0, stream, runs, tiles, tile_first, block_keys);
  launched();
}

void launch_gather(const Planes& planes, const unsigned* source, unsigned count, cudaStream_t stream) {
  if (count == 0) return;
  if (planes.word_bytes == 4) {
    BRECCIA_LAUNCH(gather<std::uint32_t>, grid_for(count), dim3(kThreads), 0, stream, planes, source, count);
  } else {
    BRECCIA_LAUNCH(gather<std::uint64_t>, grid_for(count), dim3(kThreads), 0, stream, planes, source, count);
  }
  launched();
}

void launch_reach(const unsigned* tile_first, unsigned tiles, const std::int32_t* node,
                  const grid::Periodicity& periodicity, const BlockHash& hash, BlockKey* block_keys,
                  unsigned* block_count, cudaStream_t stream) {
  if (tiles == 0) return;
  BRECCIA_LAUNCH(reach, dim3(tiles), dim3(kReachThreads), sizeof(ReachShared), stream, tile_first, node, periodicity,
                 hash, block_keys, block_count);
  launched();
}

void launch_neighbours(const BlockKey* block_keys, unsigned blocks, const grid::Periodicity& periodicity,
                       const BlockHash& hash, unsigned* neighbours, cudaStream_t stream) {
  if (blocks == 0) return;
  BRECCIA_LAUNCH(find_neighbours, grid_for(blocks * 27), dim3(kThreads), 0, stream, block_keys, blocks, periodicity,
                 hash, neighbours);
  launched();
}

void launch_lone_drift(const std::int32_t* node, const std::int32_t* node_then, unsigned count, unsigned* strayed,
                       cudaStream_t stream) {
  if (count == 0) return;
  BRECCIA_LAUNCH(lone_drift, grid_for(count), dim3(kThreads), 0, stream, node, node_then, count, strayed);
  launched();
}

}  // namespace breccia::cuda

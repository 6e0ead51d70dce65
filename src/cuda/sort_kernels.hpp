// The kernels between two sortings, in the order in which particle_sort.cpp calls them.
#pragma once

#include <cstdint>

#include "cuda/block_hash.hpp"
#include "cuda/device_runtime.hpp"
#include "grid/layout.hpp"

namespace breccia::cuda {

/// Found while particles are placed; all from 0.
struct PlaceReport {
  int highest[3];    ///< block coordinate + kBlockLimit
  int lowest[3];     ///< kBlockLimit - block coordinate
  unsigned too_far;  ///< particles beyond kBlockLimit
};

/// Block keys without what all of them share: coordinates from the lowest corner, as many bits as they need.
struct CompactKeys {
  grid::BlockCoord corner{};
  int bits[3] = {0, 0, 0};
  [[nodiscard]] int all_bits() const { return bits[0] + bits[1] + bits[2]; }
};

/// Particles from the block of the last sorting (`keys`) and their node relative to it to the block they are in now:
/// keys and nodes are renewed; cells[slot] := cell in the block in storage order, order[slot] := slot.
void launch_place(std::int32_t* node, grid::BlockKey* keys, std::uint64_t* cells, unsigned* order, unsigned count,
                  const grid::Periodicity& periodicity, PlaceReport* report, cudaStream_t stream);
/// compact[i] := that of particle order[i].
void launch_compact_keys(const grid::BlockKey* keys, const unsigned* order, std::uint64_t* compact, unsigned count,
                         const CompactKeys& layout, cudaStream_t stream);

/// Runs of particles of the same block. starts[i] = 1 where one starts, starts[count] = 1; to be scanned.
void launch_mark_runs(const std::uint64_t* compact, unsigned* starts, unsigned count, cudaStream_t stream);

struct Runs {
  unsigned count = 0;             ///< of runs
  unsigned particles = 0;         ///< in all runs
  const unsigned* of = nullptr;   ///< scanned starts: particle i is in run of[i + 1] - 1
  unsigned* first = nullptr;      ///< [count + 1] place of the first particle
  grid::BlockKey* key = nullptr;  ///< [count]
  unsigned* tiles = nullptr;      ///< [count + 1] tiles before this run, once scanned
  unsigned* tiled = nullptr;      ///< [count + 1] particles in tiles before this run, once scanned
};
void launch_list_runs(const grid::BlockKey* keys, const unsigned* order, const Runs& runs, cudaStream_t stream);

/// indices of the hash := 0 .. count-1 for these keys.
void launch_insert_all(const grid::BlockKey* keys, unsigned count, const BlockHash& hash, cudaStream_t stream);

/// Planes of blocks along an axis that belong to this rank: low <= plane < high. What others hold is not known here.
struct OwnPlanes {
  int axis = 0;
  std::int32_t low = INT32_MIN, high = INT32_MAX;
};
/// tiles[r] = 1 and tiled[r] = particles unless the run is one particle that no other can meet before the next sorting.
void launch_separate(const Runs& runs, const BlockHash& hash, const std::int32_t* node, const unsigned* order,
                     const grid::Periodicity& periodicity, const OwnPlanes& planes, bool lone_without_grid,
                     cudaStream_t stream);

/// source[slot] := where the particle of a new slot is now; tiles first, then lone particles.
void launch_arrange(const Runs& runs, const unsigned* order, unsigned tiled_particles, unsigned* source,
                    grid::BlockKey* key_of_slot, cudaStream_t stream);
void launch_list_tiles(const Runs& runs, unsigned tiles, unsigned* tile_first, grid::BlockKey* block_keys,
                       cudaStream_t stream);
/// Components of particles, `word_bytes` (4 or 8) each, that one kernel moves.
struct Planes {
  static constexpr int kMost = 8;
  const void* from[kMost] = {};
  void* to[kMost] = {};
  int count = 0;
  int word_bytes = 0;

  void add(const void* source, void* target) {
    from[count] = source;
    to[count++] = target;
  }
};
/// to[c][i] := from[c][source[i]], or from[c][i] if there is no source.
void launch_gather(const Planes& planes, const unsigned* source, unsigned count, cudaStream_t stream);

/// Adds the blocks that a tile's particles can reach until the next sorting to hash and block_keys, counts them.
void launch_reach(const unsigned* tile_first, unsigned tiles, const std::int32_t* node,
                  const grid::Periodicity& periodicity, const BlockHash& hash, grid::BlockKey* block_keys,
                  unsigned* block_count, cudaStream_t stream);
/// neighbours[block][27], x slowest.
void launch_neighbours(const grid::BlockKey* block_keys, unsigned blocks, const grid::Periodicity& periodicity,
                       const BlockHash& hash, unsigned* neighbours, cudaStream_t stream);

/// Counts lone particles that drifted more than a node since the last sorting.
void launch_lone_drift(const std::int32_t* node, const std::int32_t* node_then, unsigned count, unsigned* strayed,
                       cudaStream_t stream);

}  // namespace breccia::cuda

// Blocks found by key on the device: open addressing, filled by many threads at once. Which index a new block gets may
// depend on the order of threads; nothing that is summed does.
#pragma once

#include "cuda/device_runtime.hpp"
#include "grid/layout.hpp"

namespace breccia::cuda {

struct BlockHash {
  static constexpr unsigned long long kFree = ~0ULL;

  unsigned long long* keys = nullptr;  ///< [mask + 1], kFree where nothing is
  unsigned* indices = nullptr;
  unsigned mask = 0;
};

#if defined(__CUDACC__) || defined(BRECCIA_CUDA_EMULATED)
__device__ __forceinline__ unsigned first_slot(const BlockHash& table, grid::BlockKey key) {
  // Of the product only the highest bits hang on x.
  const grid::BlockKey product = key * 0x9E3779B97F4A7C15ULL;
  return static_cast<unsigned>(product >> 32 ^ product >> 48) & table.mask;
}

/// Index of the block or kNoBlock. Not while others insert.
__device__ __forceinline__ unsigned find(const BlockHash& table, grid::BlockKey key) {
  for (unsigned slot = first_slot(table, key);; slot = (slot + 1) & table.mask) {
    const unsigned long long found = table.keys[slot];
    if (found == key) return table.indices[slot];
    if (found == BlockHash::kFree) return grid::kNoBlock;
  }
}

/// Slot of the key; `is_new` for the one thread that has to set its index.
__device__ __forceinline__ unsigned insert(const BlockHash& table, grid::BlockKey key, bool& is_new) {
  for (unsigned slot = first_slot(table, key);; slot = (slot + 1) & table.mask) {
    const unsigned long long found =
        atomicCAS(&table.keys[slot], BlockHash::kFree, static_cast<unsigned long long>(key));
    is_new = found == BlockHash::kFree;
    if (is_new || found == key) return slot;
  }
}
#endif

}  // namespace breccia::cuda

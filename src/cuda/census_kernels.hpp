// Bodies counted in blocks of space by the device (gravity/mesh/census.hpp). Only whole numbers are added and compared,
// so that no sum depends on the order of threads: masses count in quanta.
#pragma once

#include <cstdint>

#include "cuda/mesh_kernels.hpp"
#include "gravity/mesh/block_index.hpp"

namespace breccia::cuda {

/// Blocks with bodies, found by the hash of their index: open addressing. A slot names one of the block's bodies, whose
/// place tells the index; which one, and which slot a block gets, depends on the order of threads.
struct BlockTable {
  static constexpr unsigned kNone = ~0U;

  BodyArrays bodies;
  double per_width = 0;       ///< 1 / width of the blocks [1/m]
  unsigned slots = 0;         ///< more than there are bodies
  unsigned* body = nullptr;   ///< [slots] one of the block's; kNone: free
  unsigned* count = nullptr;  ///< [slots] of bodies in the block
  unsigned* place = nullptr;  ///< [slots] of the block in a list of BlockSums; kNone: in none

  [[nodiscard]] BRECCIA_HD gravity::BlockIndex index_of(unsigned i) const {
    return gravity::block_of(bodies.at(i), per_width);
  }
};
/// Fills the table: all slots are to be free, all counts 0.
void launch_count_in_blocks(const BlockTable& table, cudaStream_t stream);

struct CountedBlock {
  gravity::BlockIndex index;
  unsigned count;
};
/// Blocks of at least `least` bodies: adds their number to `found`, which starts from 0, and lists them unless `list`
/// is null.
void launch_list_crowded(const BlockTable& table, unsigned least, unsigned* found, CountedBlock* list,
                         cudaStream_t stream);
/// counts[k] := bodies in blocks[k], k < count.
void launch_counts_of(const BlockTable& table, const gravity::BlockIndex* blocks, unsigned count, unsigned* counts,
                      cudaStream_t stream);

/// What a block holds.
struct BlockSums {
  gravity::BlockIndex index;
  unsigned count;
  unsigned long long mass;        ///< [quanta]
  unsigned long long extreme[6];  ///< rank_of() the largest x, y, z, -x, -y, -z [m]
};
/// Lists the slots of `count` blocks and of those around them that hold bodies, each once; `place` is to be kNone
/// throughout. `found`, from 0, counts them.
void launch_list_around(const BlockTable& table, const gravity::BlockIndex* blocks, unsigned count, unsigned* slots,
                        unsigned* found, cudaStream_t stream);
/// Sums of the blocks in `count` listed slots; sums are to be 0.
void launch_sum_blocks(const BlockTable& table, const unsigned* slots, unsigned count, double quanta_per_kg,
                       BlockSums* sums, cudaStream_t stream);

/// Of set 0 and of each box; all from 0.
struct SetSums {
  unsigned long long mass[gravity::kMostBoxes + 1];  ///< [quanta]
  unsigned count[gravity::kMostBoxes + 1];
};
void launch_sum_sets(const BodyArrays& bodies, const BoxList& boxes, double quanta_per_kg, SetSums* sums,
                     cudaStream_t stream);

/// Whole numbers in the order of the numbers that they stand for; 0 is below all.
BRECCIA_HD unsigned long long rank_of(double x) {
  constexpr unsigned long long sign = 1ULL << 63;
  const auto bits = __builtin_bit_cast(unsigned long long, x);
  return (bits & sign) != 0 ? ~bits : bits | sign;
}
inline double of_rank(unsigned long long rank) {
  constexpr unsigned long long sign = 1ULL << 63;
  return __builtin_bit_cast(double, (rank & sign) != 0 ? rank ^ sign : ~rank);
}

}  // namespace breccia::cuda

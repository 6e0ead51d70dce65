#include "cuda/census_kernels.hpp"
#include "cuda/check.hpp"
#include "cuda/launchers.hpp"

namespace breccia::cuda {
namespace {

using gravity::BlockIndex;

constexpr unsigned kThreads = 128;
constexpr unsigned kWarp = 32;
constexpr unsigned kAllLanes = 0xffffffffU;
constexpr unsigned kMostSetBlocks = 512;  // of threads: enough to fill a device, few to meet at the same sums
constexpr unsigned kMarked = BlockTable::kNone - 1;

__device__ __forceinline__ unsigned thread_number() { return blockIdx.x * kThreads + threadIdx.x; }

__device__ __forceinline__ unsigned first_slot(const BlockTable& table, BlockIndex index) {
  return static_cast<unsigned>((gravity::hash_of(index) >> 32) * table.slots >> 32);
}
__device__ __forceinline__ unsigned next_slot(const BlockTable& table, unsigned slot) {
  return slot + 1 < table.slots ? slot + 1 : 0;
}

// The slot of the block that body i is in, taken for it if it has none.
__device__ __forceinline__ unsigned insert(const BlockTable& table, unsigned i) {
  const BlockIndex index = table.index_of(i);
  for (unsigned slot = first_slot(table, index);; slot = next_slot(table, slot)) {
    const unsigned there = atomicCAS(&table.body[slot], BlockTable::kNone, i);
    if (there == BlockTable::kNone || table.index_of(there) == index) return slot;
  }
}

// kNone if the block holds no body. Not while others insert.
__device__ __forceinline__ unsigned find(const BlockTable& table, BlockIndex index) {
  for (unsigned slot = first_slot(table, index);; slot = next_slot(table, slot)) {
    const unsigned there = table.body[slot];
    if (there == BlockTable::kNone) return BlockTable::kNone;
    if (table.index_of(there) == index) return slot;
  }
}

// quanta_per_kg is a power of two: only the last quantum is rounded.
__device__ __forceinline__ unsigned long long quanta(double mass, double quanta_per_kg) {
  return static_cast<unsigned long long>(mass * quanta_per_kg + 0.5);
}

__global__ void __launch_bounds__(kThreads) count_in_blocks(BlockTable table) {
  const unsigned i = thread_number();
  if (i < table.bodies.count) atomicAdd(&table.count[insert(table, i)], 1U);
}

__global__ void __launch_bounds__(kThreads)
    list_crowded(BlockTable table, unsigned least, unsigned* found, CountedBlock* list) {
  const unsigned slot = thread_number();
  if (slot >= table.slots) return;
  const unsigned count = table.count[slot];
  if (count < least) return;
  const unsigned n = atomicAdd(found, 1U);
  if (list != nullptr) list[n] = {table.index_of(table.body[slot]), count};
}

__global__ void __launch_bounds__(kThreads)
    counts_of(BlockTable table, const BlockIndex* blocks, unsigned count, unsigned* counts) {
  const unsigned k = thread_number();
  if (k >= count) return;
  const unsigned slot = find(table, blocks[k]);
  counts[k] = slot == BlockTable::kNone ? 0U : table.count[slot];
}

__global__ void __launch_bounds__(kThreads)
    list_around(BlockTable table, const BlockIndex* blocks, unsigned count, unsigned* slots, unsigned* found) {
  const unsigned n = thread_number();
  if (n / gravity::kBlocksAround >= count) return;
  const unsigned slot =
      find(table, gravity::block_around(blocks[n / gravity::kBlocksAround], n % gravity::kBlocksAround));
  if (slot == BlockTable::kNone) return;
  if (atomicCAS(&table.place[slot], BlockTable::kNone, kMarked) != BlockTable::kNone) return;  // another one's, too
  slots[atomicAdd(found, 1U)] = slot;
}

__global__ void __launch_bounds__(kThreads)
    place_listed(BlockTable table, const unsigned* slots, unsigned count, BlockSums* sums) {
  const unsigned k = thread_number();
  if (k >= count) return;
  table.place[slots[k]] = k;
  sums[k].index = table.index_of(table.body[slots[k]]);
  sums[k].count = table.count[slots[k]];
}

__global__ void __launch_bounds__(kThreads) add_bodies(BlockTable table, double quanta_per_kg, BlockSums* sums) {
  const unsigned i = thread_number();
  if (i >= table.bodies.count) return;
  const unsigned place = table.place[find(table, table.index_of(i))];
  if (place == BlockTable::kNone) return;
  BlockSums& to = sums[place];
  atomicAdd(&to.mass, quanta(table.bodies.mass[i], quanta_per_kg));
  for (int axis = 0; axis < 3; ++axis) {
    const double x = table.bodies.position[axis][i];
    atomicMax(&to.extreme[axis], rank_of(x));
    atomicMax(&to.extreme[3 + axis], rank_of(-x));
  }
}

template <class T>
__device__ __forceinline__ T warp_sum(T value) {
  for (unsigned step = kWarp / 2; step > 0; step /= 2) value += __shfl_down_sync(kAllLanes, value, step);
  return value;
}

__global__ void __launch_bounds__(kThreads)
    sum_sets(BodyArrays bodies, BoxList boxes, double quanta_per_kg, SetSums* sums) {
  constexpr unsigned sets = gravity::kMostBoxes + 1;
  unsigned long long mass[sets] = {};
  unsigned count[sets] = {};
  for (unsigned i = thread_number(); i < bodies.count; i += gridDim.x * kThreads) {
    const unsigned set = gravity::set_of(bodies.at(i), boxes.box, boxes.count);
    const unsigned long long own = quanta(bodies.mass[i], quanta_per_kg);
    for (unsigned k = 0; k < sets; ++k) {  // no index that is known late: sums stay in registers
      mass[k] += set == k ? own : 0U;
      count[k] += set == k ? 1U : 0U;
    }
  }
  for (unsigned k = 0; k < sets; ++k) {
    const unsigned long long mass_of_warp = warp_sum(mass[k]);
    const unsigned count_of_warp = warp_sum(count[k]);
    if (threadIdx.x % kWarp != 0 || count_of_warp == 0) continue;
    atomicAdd(&sums->mass[k], mass_of_warp);
    atomicAdd(&sums->count[k], count_of_warp);
  }
}

dim3 threads_for(unsigned items) { return {blocks_for(items, kThreads)}; }
void launched() { check(cudaGetLastError(), "launch of a kernel that counts bodies in blocks"); }

}  // namespace

void launch_count_in_blocks(const BlockTable& table, cudaStream_t stream) {
  if (table.bodies.count == 0) return;
  BRECCIA_LAUNCH(count_in_blocks, threads_for(table.bodies.count), dim3(kThreads), 0, stream, table);
  launched();
}

void launch_list_crowded(const BlockTable& table, unsigned least, unsigned* found, CountedBlock* list,
                         cudaStream_t stream) {
  BRECCIA_LAUNCH(list_crowded, threads_for(table.slots), dim3(kThreads), 0, stream, table, least, found, list);
  launched();
}

void launch_counts_of(const BlockTable& table, const BlockIndex* blocks, unsigned count, unsigned* counts,
                      cudaStream_t stream) {
  if (count == 0) return;
  BRECCIA_LAUNCH(counts_of, threads_for(count), dim3(kThreads), 0, stream, table, blocks, count, counts);
  launched();
}

void launch_list_around(const BlockTable& table, const BlockIndex* blocks, unsigned count, unsigned* slots,
                        unsigned* found, cudaStream_t stream) {
  if (count == 0) return;
  BRECCIA_LAUNCH(list_around, threads_for(gravity::kBlocksAround * count), dim3(kThreads), 0, stream, table, blocks,
                 count, slots, found);
  launched();
}

void launch_sum_blocks(const BlockTable& table, const unsigned* slots, unsigned count, double quanta_per_kg,
                       BlockSums* sums, cudaStream_t stream) {
  if (count == 0) return;
  BRECCIA_LAUNCH(place_listed, threads_for(count), dim3(kThreads), 0, stream, table, slots, count, sums);
  BRECCIA_LAUNCH(add_bodies, threads_for(table.bodies.count), dim3(kThreads), 0, stream, table, quanta_per_kg, sums);
  launched();
}

void launch_sum_sets(const BodyArrays& bodies, const BoxList& boxes, double quanta_per_kg, SetSums* sums,
                     cudaStream_t stream) {
  if (bodies.count == 0) return;
  const unsigned blocks = blocks_for(bodies.count, kThreads);
  BRECCIA_LAUNCH(sum_sets, dim3(blocks < kMostSetBlocks ? blocks : kMostSetBlocks), dim3(kThreads), 0, stream, bodies,
                 boxes, quanta_per_kg, sums);
  launched();
}

}  // namespace breccia::cuda

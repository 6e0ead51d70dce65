#include "cuda/launchers.hpp"
#include "cuda/primitives.hpp"

namespace breccia::cuda {
namespace {

constexpr unsigned kAllLanes = 0xffffffffU;
constexpr int kWarps = 8;
constexpr int kThreads = 32 * kWarps;

// Inclusive sum over the lanes of a warp.
__device__ __forceinline__ unsigned warp_sum_up_to(unsigned value, int lane) {
  for (unsigned delta = 1; delta < 32; delta *= 2) {
    const unsigned below = __shfl_up_sync(kAllLanes, value, delta);
    if (lane >= static_cast<int>(delta)) value += below;
  }
  return value;
}

// --- scan -----------------------------------------------------------------------------------------------------------

constexpr int kScanItems = 4;  // of a thread
constexpr unsigned kScanBlock = kThreads * kScanItems;

struct ScanShared {
  unsigned of_warp[kWarps];
};

// Exclusive scan of each stretch of kScanBlock; its sum to sums[block].
__global__ void scan_blocks(unsigned* values, unsigned count, unsigned* sums) {
  BRECCIA_SHARED(ScanShared, shared);
  const int thread = static_cast<int>(threadIdx.x);
  const int lane = thread % 32;
  const int warp = thread / 32;
  const unsigned first = blockIdx.x * kScanBlock + static_cast<unsigned>(thread * kScanItems);
  unsigned item[kScanItems];
  unsigned own = 0;
  for (unsigned n = 0; n < kScanItems; ++n) {
    item[n] = first + n < count ? values[first + n] : 0U;
    own += item[n];
  }
  const unsigned up_to = warp_sum_up_to(own, lane);
  if (lane == 31) shared.of_warp[warp] = up_to;
  __syncthreads();
  unsigned before = up_to - own;
  for (int w = 0; w < warp; ++w) before += shared.of_warp[w];
  if (thread == kThreads - 1) sums[blockIdx.x] = before + own;
  for (unsigned n = 0; n < kScanItems; ++n) {
    if (first + n < count) values[first + n] = before;
    before += item[n];
  }
}

__global__ void add_block_sums(unsigned* values, unsigned count, const unsigned* sums) {
  const unsigned i = blockIdx.x * kThreads + threadIdx.x;
  if (i < count) values[i] += sums[i / kScanBlock];
}

void scan_level(unsigned* values, unsigned count, int level, PrimitiveScratch& scratch, cudaStream_t stream) {
  const unsigned blocks = blocks_for(count, kScanBlock);
  DeviceArray<unsigned>& sums = scratch.sums[level];
  sums.reserve(blocks);
  BRECCIA_LAUNCH(scan_blocks, dim3(blocks), dim3(kThreads), sizeof(ScanShared), stream, values, count, sums.data());
  if (blocks == 1) return;
  scan_level(sums.data(), blocks, level + 1, scratch, stream);
  BRECCIA_LAUNCH(add_block_sums, dim3(blocks_for(count, kThreads)), dim3(kThreads), 0, stream, values, count,
                 sums.data());
}

// --- radix sort -----------------------------------------------------------------------------------------------------

constexpr int kDigits = 256;
constexpr int kRounds = 8;
constexpr unsigned kSortBlock = kThreads * kRounds;

__device__ __forceinline__ unsigned digit_of(std::uint64_t key, int shift) {
  return static_cast<unsigned>(key >> shift) & (kDigits - 1);
}

struct CountShared {
  unsigned of_digit[kDigits];
};

// counts[digit][block]: how many keys of a block have a digit.
__global__ void count_digits(const std::uint64_t* keys, unsigned count, int shift, unsigned* counts) {
  BRECCIA_SHARED(CountShared, shared);
  shared.of_digit[threadIdx.x] = 0;
  __syncthreads();
  const unsigned first = blockIdx.x * kSortBlock + threadIdx.x;
  for (unsigned n = first; n < first + kSortBlock; n += kThreads) {
    if (n < count) atomicAdd(&shared.of_digit[digit_of(keys[n], shift)], 1U);
  }
  __syncthreads();
  counts[threadIdx.x * gridDim.x + blockIdx.x] = shared.of_digit[threadIdx.x];
}

struct PlaceShared {
  unsigned next[kDigits];  // place of the next key with this digit
  unsigned of_warp[kWarps][kDigits];
};

// Lanes that are in use and have the same digit as this one.
__device__ __forceinline__ unsigned lanes_alike(unsigned digit, bool used) {
  unsigned alike = __ballot_sync(kAllLanes, used ? 1 : 0);
  for (int bit = 0; bit < 8; ++bit) {
    const unsigned set = __ballot_sync(kAllLanes, static_cast<int>(digit >> bit & 1U));
    alike &= (digit >> bit & 1U) != 0 ? set : ~set;
  }
  return alike;
}

// Pairs to their places, round after round of kThreads, which keeps the order of equal ones.
__global__ void place_pairs(const std::uint64_t* keys, const unsigned* values, unsigned count, int shift,
                            const unsigned* places, std::uint64_t* sorted_keys, unsigned* sorted_values) {
  BRECCIA_SHARED(PlaceShared, shared);
  const unsigned thread = threadIdx.x;
  const unsigned lane = thread % 32;
  const unsigned warp = thread / 32;
  shared.next[thread] = places[thread * gridDim.x + blockIdx.x];
  for (int round = 0; round < kRounds; ++round) {
    for (int w = 0; w < kWarps; ++w) shared.of_warp[w][thread] = 0;
    __syncthreads();
    const unsigned i = blockIdx.x * kSortBlock + static_cast<unsigned>(round) * kThreads + thread;
    const bool used = i < count;
    const std::uint64_t key = used ? keys[i] : 0U;
    const unsigned digit = digit_of(key, shift);
    const unsigned alike = lanes_alike(digit, used);
    const auto before = static_cast<unsigned>(__popc(alike & ((1U << lane) - 1)));
    if (used && before == 0) shared.of_warp[warp][digit] = static_cast<unsigned>(__popc(alike));
    __syncthreads();
    if (used) {
      unsigned place = shared.next[digit] + before;
      for (unsigned w = 0; w < warp; ++w) place += shared.of_warp[w][digit];
      sorted_keys[place] = key;
      sorted_values[place] = values[i];
    }
    __syncthreads();
    for (int w = 0; w < kWarps; ++w) shared.next[thread] += shared.of_warp[w][thread];
    __syncthreads();
  }
}

// --- keys -----------------------------------------------------------------------------------------------------------

__global__ void find_first(const std::uint64_t* sorted, unsigned count, unsigned keys, unsigned* first) {
  const unsigned k = blockIdx.x * kThreads + threadIdx.x;
  if (k > keys) return;
  unsigned low = 0;
  for (unsigned high = count; low < high;) {
    const unsigned middle = low + (high - low) / 2;
    if (sorted[middle] < k) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  first[k] = low;
}

}  // namespace

void exclusive_scan(unsigned* values, unsigned count, PrimitiveScratch& scratch, cudaStream_t stream) {
  if (count > 0) scan_level(values, count, 0, scratch, stream);
}

void radix_sort(DeviceArray<std::uint64_t>& keys, DeviceArray<unsigned>& values, unsigned count, int first_bit,
                int last_bit, PrimitiveScratch& scratch, cudaStream_t stream) {
  static_assert(kThreads == kDigits);
  if (count == 0) return;
  const unsigned blocks = blocks_for(count, kSortBlock);
  scratch.keys.reserve(count);
  scratch.values.reserve(count);
  scratch.counts.reserve(std::size_t{kDigits} * blocks);
  for (int shift = first_bit; shift < last_bit; shift += 8) {
    BRECCIA_LAUNCH(count_digits, dim3(blocks), dim3(kThreads), sizeof(CountShared), stream, keys.data(), count, shift,
                   scratch.counts.data());
    exclusive_scan(scratch.counts.data(), kDigits * blocks, scratch, stream);
    BRECCIA_LAUNCH(place_pairs, dim3(blocks), dim3(kThreads), sizeof(PlaceShared), stream, keys.data(), values.data(),
                   count, shift, scratch.counts.data(), scratch.keys.data(), scratch.values.data());
    keys.swap(scratch.keys);
    values.swap(scratch.values);
  }
  check(cudaGetLastError(), "launch of a sort");
}

void first_of_keys(const std::uint64_t* sorted, unsigned count, unsigned keys, unsigned* first, cudaStream_t stream) {
  BRECCIA_LAUNCH(find_first, dim3(blocks_for(keys + 1, kThreads)), dim3(kThreads), 0, stream, sorted, count, keys,
                 first);
  check(cudaGetLastError(), "launch of a search for keys");
}

}  // namespace breccia::cuda

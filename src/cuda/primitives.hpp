// Scan and stable radix sort on the device. Own ones: the library's cannot run in the emulation, so that the driver
// code around them could not be tested without a device; sorting is once in some thirty steps.
#pragma once

#include <cstdint>

#include "cuda/device_array.hpp"
#include "cuda/device_runtime.hpp"

namespace breccia::cuda {

/// Working memory of the primitives; grows as needed.
struct PrimitiveScratch {
  DeviceArray<unsigned> sums[3];  ///< of blocks, of blocks of blocks, ...
  DeviceArray<unsigned> counts;
  DeviceArray<std::uint64_t> keys;
  DeviceArray<unsigned> values;
};

/// values[i] := sum of values[0 .. i-1] for i = 0 .. count-1.
void exclusive_scan(unsigned* values, unsigned count, PrimitiveScratch& scratch, cudaStream_t stream);

/// Sorts pairs by bits [first_bit, last_bit) of the keys, 8 bits a pass; equal ones keep their order. Where the result
/// lies is told by swapping the arrays with those of the scratch.
void radix_sort(DeviceArray<std::uint64_t>& keys, DeviceArray<unsigned>& values, unsigned count, int first_bit,
                int last_bit, PrimitiveScratch& scratch, cudaStream_t stream);

/// first[k] := place of the first of the sorted keys that is not below k, for k = 0 .. keys.
void first_of_keys(const std::uint64_t* sorted, unsigned count, unsigned keys, unsigned* first, cudaStream_t stream);

}  // namespace breccia::cuda

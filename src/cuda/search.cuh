// Search in sorted numbers.
#pragma once

#include "cuda/device_runtime.hpp"

namespace breccia::cuda {

/// Last of the sorted first[0 .. count] that is not above p.
__device__ __forceinline__ unsigned place_of(unsigned p, const unsigned* first, unsigned count) {
  unsigned low = 0;
  unsigned high = count;
  while (high - low > 1) {
    const unsigned middle = low + (high - low) / 2;
    (first[middle] <= p ? low : high) = middle;
  }
  return low;
}

}  // namespace breccia::cuda

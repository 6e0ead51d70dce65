// A sum over a block and a count over all blocks, right and with one mistake each: what the emulation must catch.
#pragma once

#include <limits>

#include "cuda/device_runtime.hpp"

namespace breccia::cuda_test {

inline constexpr int kThreads = 64;

struct Values {
  int of[kThreads];
  int end[1];
};

enum class Fault {
  kNone,
  kNoBarrier,
  kDivergentBarrier,
  kEarlyExit,
  kOverrun,
  kNoAtomic,
  kGlobalOverrun,
  kLostLane,
  kOverflow
};

/// total += sum over the blocks of 0 + 1 + ... + 63.
template <Fault kFault>
__global__ void sum_of_blocks(int* total) {
  BRECCIA_SHARED(Values, values);
  const int t = static_cast<int>(threadIdx.x);
  // The last thread writes first what the others read last.
  int* const of = values.of;  // a pointer, whose bounds no compiler knows
  of[kFault == Fault::kOverrun ? t + 2 : kThreads - 1 - t] = t;
  if (kFault == Fault::kEarlyExit && t == 5) return;
  if (kFault == Fault::kDivergentBarrier && t >= 32) {
    __syncthreads();  // NOLINT(bugprone-branch-clone): another one than the next
  } else if (kFault != Fault::kNoBarrier) {
    __syncthreads();
  }
  int sum = 0;
  for (const int value : values.of) sum += value;
  if (kFault == Fault::kLostLane) {
    if (t % 2 == 0) sum = __shfl_sync(0xffffffffU, sum, 0);
  }
  if (t != 0) return;
  if (kFault == Fault::kOverflow) sum += std::numeric_limits<int>::max();
  if (kFault == Fault::kNoAtomic) {
    *total = *total + sum;
  } else {
    atomicAdd(total, sum);
  }
  if (kFault == Fault::kGlobalOverrun) total[1] = 1;
}

}  // namespace breccia::cuda_test

// The faulty kernels for nvcc.
#include "tests/cuda/faulty_kernels.hpp"

namespace breccia::cuda_test {

template __global__ void sum_of_blocks<Fault::kNone>(int*);
template __global__ void sum_of_blocks<Fault::kNoBarrier>(int*);
template __global__ void sum_of_blocks<Fault::kDivergentBarrier>(int*);
template __global__ void sum_of_blocks<Fault::kEarlyExit>(int*);
template __global__ void sum_of_blocks<Fault::kOverrun>(int*);
template __global__ void sum_of_blocks<Fault::kGlobalOverrun>(int*);
template __global__ void sum_of_blocks<Fault::kLostLane>(int*);

}  // namespace breccia::cuda_test

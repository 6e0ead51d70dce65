// Calls of the CUDA runtime that fail become one clear error.
#pragma once

#include <string>

#include "breccia/error.hpp"
#include "cuda/device_runtime.hpp"

namespace breccia::cuda {

inline void check(cudaError_t status, const char* what) {
  if (status == cudaSuccess) return;
  throw NumericsError(std::string("CUDA: ") + what + ": " + cudaGetErrorString(status));
}

/// Now, and not at the first launch, for which a stream that waits for the host could be in the way.
template <class Kernel>
void load(Kernel* kernel) {
  cudaFuncAttributes attributes{};
  check(cudaFuncGetAttributes(&attributes, kernel), "kernel");
}

}  // namespace breccia::cuda

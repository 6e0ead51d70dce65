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

/// Loads a kernel now: its first launch would, and may wait for the whole device to do so.
template <class Kernel>
void load(Kernel* kernel) {
  cudaFuncAttributes attributes{};
  check(cudaFuncGetAttributes(&attributes, kernel), "kernel");
}

}  // namespace breccia::cuda

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

}  // namespace breccia::cuda

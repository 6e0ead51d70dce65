// The CUDA runtime, or in tests its emulation on the CPU (tests/cuda/emulation), and the two constructs of CUDA that a
// host compiler cannot read: the launch of a kernel and dynamic shared memory. Everything else of CUDA that kernels use
// is ordinary C++ for both, and use_only() tells the emulation what no device wants to know.
#pragma once

#if defined(BRECCIA_CUDA_EMULATED)

#include "tests/cuda/emulation/cuda_emulation.hpp"

namespace breccia::cuda {
using cuda_emulation::use_only;
}

#else

#include <cuda_runtime.h>

#include <cstddef>

namespace breccia::cuda {
/// Of this allocation the first `bytes` are in use: no kernel may touch what follows.
inline void use_only(const void* /*memory*/, std::size_t /*bytes*/) {}
}  // namespace breccia::cuda

#if defined(__CUDACC__)
   /// kernel<<<grid, block, shared_bytes, stream>>>(arguments...)
#define BRECCIA_LAUNCH(kernel, grid, block, shared_bytes, stream, ...) \
  kernel<<<grid, block, shared_bytes, stream>>>(__VA_ARGS__)

/// All shared memory of a kernel is one struct: Type& name. The launch gives its size.
#define BRECCIA_SHARED(Type, name)                              \
  extern __shared__ __align__(16) unsigned char name##_bytes[]; \
  Type& name = *reinterpret_cast<Type*>(name##_bytes)
#endif

#endif

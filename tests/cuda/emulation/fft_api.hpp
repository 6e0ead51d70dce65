// The calls of cuFFT that the engine makes, for the emulation, over FFTW: batched transforms with the same parameters.
#pragma once

#include "tests/cuda/emulation/cuda_emulation.hpp"

// The names are cuFFT's.
// NOLINTBEGIN(readability-identifier-naming)
using cufftHandle = int;
using cufftComplex = float[2];
using cufftDoubleComplex = double[2];
enum cufftResult { CUFFT_SUCCESS = 0, CUFFT_INVALID_PLAN = 1, CUFFT_INVALID_VALUE = 4 };
enum cufftType { CUFFT_R2C, CUFFT_C2R, CUFFT_C2C, CUFFT_D2Z, CUFFT_Z2D, CUFFT_Z2Z };
inline constexpr int CUFFT_FORWARD = -1;
inline constexpr int CUFFT_INVERSE = 1;

cufftResult cufftCreate(cufftHandle* plan);
/// The emulation never allocates: it takes 0 only.
cufftResult cufftSetAutoAllocation(cufftHandle plan, int allocates);
/// The work area is as large as the complex data.
cufftResult cufftMakePlanMany(cufftHandle plan, int rank, int* lengths, int* in_extents, int in_stride, int in_distance,
                              int* out_extents, int out_stride, int out_distance, cufftType type, int count,
                              std::size_t* work_bytes);
/// Must have the size that the plan asked for.
cufftResult cufftSetWorkArea(cufftHandle plan, void* area);
cufftResult cufftSetStream(cufftHandle plan, cudaStream_t stream);
cufftResult cufftDestroy(cufftHandle plan);
cufftResult cufftExecC2C(cufftHandle plan, cufftComplex* in, cufftComplex* out, int direction);
cufftResult cufftExecR2C(cufftHandle plan, float* in, cufftComplex* out);
cufftResult cufftExecC2R(cufftHandle plan, cufftComplex* in, float* out);
cufftResult cufftExecZ2Z(cufftHandle plan, cufftDoubleComplex* in, cufftDoubleComplex* out, int direction);
cufftResult cufftExecD2Z(cufftHandle plan, double* in, cufftDoubleComplex* out);
cufftResult cufftExecZ2D(cufftHandle plan, cufftDoubleComplex* in, double* out);
// NOLINTEND(readability-identifier-naming)

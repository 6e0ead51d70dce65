#include "tests/cuda/emulation/fft_api.hpp"

#include <fftw3.h>

#include <functional>
#include <map>
#include <vector>

namespace breccia::cuda_emulation {

namespace {

// What cufftMakePlanMany() was told. FFTW plans for the arrays at hand, when the work is done: it takes their
// alignment.
struct Plan {
  std::vector<int> lengths, in_extents, out_extents;
  int in_stride = 0, in_distance = 0, out_stride = 0, out_distance = 0, count = 0;
  cufftType type = CUFFT_C2C;
  std::size_t work_bytes = 0;
  cudaStream_t stream = nullptr;
  bool has_work_area = false;
};

std::map<cufftHandle, Plan>& plans() {
  static std::map<cufftHandle, Plan> all;
  return all;
}

// Runs make(plan) as late as the stream allows, and the transform that it plans.
template <class Make, class Run, class Destroy>
cufftResult enqueue_transform(cufftHandle handle, cufftType type, Make make, Run run, Destroy destroy) {
  const auto found = plans().find(handle);
  if (found == plans().end() || found->second.type != type || found->second.stream == nullptr ||
      !found->second.has_work_area)
    return CUFFT_INVALID_PLAN;
  found->second.stream->enqueue([p = found->second, make, run, destroy] {
    const auto plan = make(p);
    run(plan);
    destroy(plan);
  });
  return CUFFT_SUCCESS;
}

}  // namespace
}  // namespace breccia::cuda_emulation

using breccia::cuda_emulation::enqueue_transform;
using breccia::cuda_emulation::Plan;
using breccia::cuda_emulation::plans;

// NOLINTBEGIN(readability-identifier-naming)
cufftResult cufftCreate(cufftHandle* plan) {
  static cufftHandle last = 0;
  *plan = ++last;
  plans()[last] = {};
  return CUFFT_SUCCESS;
}

cufftResult cufftSetAutoAllocation(cufftHandle plan, int allocates) {
  if (allocates != 0) return CUFFT_INVALID_VALUE;
  return plans().contains(plan) ? CUFFT_SUCCESS : CUFFT_INVALID_PLAN;
}

cufftResult cufftMakePlanMany(cufftHandle plan, int rank, int* lengths, int* in_extents, int in_stride, int in_distance,
                              int* out_extents, int out_stride, int out_distance, cufftType type, int count,
                              std::size_t* work_bytes) {
  const auto found = plans().find(plan);
  if (found == plans().end()) return CUFFT_INVALID_PLAN;
  if (rank < 1 || rank > 3 || count < 1) return CUFFT_INVALID_VALUE;
  const bool is_double = type == CUFFT_D2Z || type == CUFFT_Z2D || type == CUFFT_Z2Z;
  const bool is_complex = type == CUFFT_C2C || type == CUFFT_Z2Z;
  std::size_t values = static_cast<std::size_t>(count);
  for (int axis = 0; axis < rank; ++axis) {
    const bool halved = !is_complex && axis == rank - 1;
    values *= static_cast<std::size_t>(halved ? lengths[axis] / 2 + 1 : lengths[axis]);
  }
  *work_bytes = values * (is_double ? sizeof(cufftDoubleComplex) : sizeof(cufftComplex));
  found->second = {.lengths = {lengths, lengths + rank},
                   .in_extents = {in_extents, in_extents + rank},
                   .out_extents = {out_extents, out_extents + rank},
                   .in_stride = in_stride,
                   .in_distance = in_distance,
                   .out_stride = out_stride,
                   .out_distance = out_distance,
                   .count = count,
                   .type = type,
                   .work_bytes = *work_bytes};
  return CUFFT_SUCCESS;
}

cufftResult cufftSetWorkArea(cufftHandle plan, void* area) {
  const auto found = plans().find(plan);
  if (found == plans().end()) return CUFFT_INVALID_PLAN;
  const std::span<const unsigned char> held = breccia::cuda_emulation::allocation_of(area);
  if (held.data() != area || held.size() < found->second.work_bytes) return CUFFT_INVALID_VALUE;
  found->second.has_work_area = true;
  return CUFFT_SUCCESS;
}

cufftResult cufftSetStream(cufftHandle plan, cudaStream_t stream) {
  const auto found = plans().find(plan);
  if (found == plans().end()) return CUFFT_INVALID_PLAN;
  found->second.stream = stream;
  return CUFFT_SUCCESS;
}

cufftResult cufftDestroy(cufftHandle plan) { return plans().erase(plan) == 1 ? CUFFT_SUCCESS : CUFFT_INVALID_PLAN; }

// FFTW takes the arguments of cufftMakePlanMany() in the same order, with the arrays between them.
#define BRECCIA_EMULATED_FFT(fftw, Real, Complex, between, from_real, to_real, ExecBetween, ExecFromReal, ExecToReal) \
  cufftResult ExecBetween(cufftHandle plan, Complex* in, Complex* out, int direction) {                               \
    return enqueue_transform(                                                                                         \
        plan, between,                                                                                                \
        [=](const Plan& p) {                                                                                          \
          return fftw##_plan_many_dft(static_cast<int>(p.lengths.size()), p.lengths.data(), p.count, in,              \
                                      p.in_extents.data(), p.in_stride, p.in_distance, out, p.out_extents.data(),     \
                                      p.out_stride, p.out_distance, direction, FFTW_ESTIMATE);                        \
        },                                                                                                            \
        fftw##_execute, fftw##_destroy_plan);                                                                         \
  }                                                                                                                   \
  cufftResult ExecFromReal(cufftHandle plan, Real* in, Complex* out) {                                                \
    return enqueue_transform(                                                                                         \
        plan, from_real,                                                                                              \
        [=](const Plan& p) {                                                                                          \
          return fftw##_plan_many_dft_r2c(static_cast<int>(p.lengths.size()), p.lengths.data(), p.count, in,          \
                                          p.in_extents.data(), p.in_stride, p.in_distance, out, p.out_extents.data(), \
                                          p.out_stride, p.out_distance, FFTW_ESTIMATE);                               \
        },                                                                                                            \
        fftw##_execute, fftw##_destroy_plan);                                                                         \
  }                                                                                                                   \
  cufftResult ExecToReal(cufftHandle plan, Complex* in, Real* out) {                                                  \
    return enqueue_transform(                                                                                         \
        plan, to_real,                                                                                                \
        [=](const Plan& p) {                                                                                          \
          return fftw##_plan_many_dft_c2r(static_cast<int>(p.lengths.size()), p.lengths.data(), p.count, in,          \
                                          p.in_extents.data(), p.in_stride, p.in_distance, out, p.out_extents.data(), \
                                          p.out_stride, p.out_distance, FFTW_ESTIMATE);                               \
        },                                                                                                            \
        fftw##_execute, fftw##_destroy_plan);                                                                         \
  }
BRECCIA_EMULATED_FFT(fftwf, float, cufftComplex, CUFFT_C2C, CUFFT_R2C, CUFFT_C2R, cufftExecC2C, cufftExecR2C,
                     cufftExecC2R)
BRECCIA_EMULATED_FFT(fftw, double, cufftDoubleComplex, CUFFT_Z2Z, CUFFT_D2Z, CUFFT_Z2D, cufftExecZ2Z, cufftExecD2Z,
                     cufftExecZ2D)
#undef BRECCIA_EMULATED_FFT
// NOLINTEND(readability-identifier-naming)

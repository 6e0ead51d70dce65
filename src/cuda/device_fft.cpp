#include "cuda/device_fft.hpp"

#include <string>

#include "breccia/error.hpp"

namespace breccia::cuda {
namespace {

using gravity::FftKind;

// cuFFT's names for each precision.
template <class Real>
struct Cufft;
template <>
struct Cufft<float> {
  using Complex = cufftComplex;
  static constexpr cufftType kBetween = CUFFT_C2C;
  static constexpr cufftType kFromReal = CUFFT_R2C;
  static constexpr cufftType kToReal = CUFFT_C2R;
  static constexpr auto kRun = cufftExecC2C;
  static constexpr auto kRunReal = cufftExecR2C;
  static constexpr auto kRunBack = cufftExecC2R;
};
template <>
struct Cufft<double> {
  using Complex = cufftDoubleComplex;
  static constexpr cufftType kBetween = CUFFT_Z2Z;
  static constexpr cufftType kFromReal = CUFFT_D2Z;
  static constexpr cufftType kToReal = CUFFT_Z2D;
  static constexpr auto kRun = cufftExecZ2Z;
  static constexpr auto kRunReal = cufftExecD2Z;
  static constexpr auto kRunBack = cufftExecZ2D;
};

template <class Real>
cufftResult make_plan(cufftHandle plan, FftKind kind, const FftLayout& l, std::size_t& work_bytes) {
  using F = Cufft<Real>;
  const auto rank = static_cast<int>(l.lengths.size());
  std::vector<int> lengths = l.lengths;
  // What the library takes as the extents in memory; the first one is not looked at.
  std::vector<int> complex = lengths;
  if (kind == FftKind::kForward || kind == FftKind::kBackward) {
    return cufftMakePlanMany(plan, rank, lengths.data(), complex.data(), l.stride, l.distance, complex.data(), l.stride,
                             l.distance, F::kBetween, l.count, &work_bytes);
  }
  complex.back() = lengths.back() / 2 + 1;
  std::vector<int> real = complex;
  real.back() *= 2;
  if (kind == FftKind::kRealToComplex) {
    return cufftMakePlanMany(plan, rank, lengths.data(), real.data(), 1, 2 * l.distance, complex.data(), 1, l.distance,
                             F::kFromReal, l.count, &work_bytes);
  }
  return cufftMakePlanMany(plan, rank, lengths.data(), complex.data(), 1, l.distance, real.data(), 1, 2 * l.distance,
                           F::kToReal, l.count, &work_bytes);
}

}  // namespace

template <class Real>
DeviceFft<Real>::DeviceFft(FftKind kind, const FftLayout& layout, cudaStream_t stream)
    : kind_(kind), empty_(layout.count == 0) {
  if (empty_) return;
  cufftResult result = cufftCreate(&plan_);
  if (result == CUFFT_SUCCESS) result = cufftSetAutoAllocation(plan_, 0);
  if (result == CUFFT_SUCCESS) result = make_plan<Real>(plan_, kind, layout, work_bytes_);
  if (result == CUFFT_SUCCESS) result = cufftSetStream(plan_, stream);
  if (result == CUFFT_SUCCESS) return;
  throw UsageError("gravity mesh on the device: cuFFT makes no " + std::to_string(layout.count) +
                   " transforms of length " + std::to_string(layout.lengths.back()) + " (error " +
                   std::to_string(static_cast<int>(result)) + "); use fewer mesh cells, or --device host");
}

template <class Real>
DeviceFft<Real>::~DeviceFft() {
  if (!empty_) cufftDestroy(plan_);
}

template <class Real>
void DeviceFft<Real>::use_work_area(std::byte* area) {
  if (work_bytes_ == 0) return;
  if (cufftSetWorkArea(plan_, area) != CUFFT_SUCCESS) throw NumericsError("CUDA: cuFFT takes no work area");
}

template <class Real>
void DeviceFft<Real>::operator()(Complex* data) const {
  using F = Cufft<Real>;
  if (empty_) return;
  auto* complex = reinterpret_cast<typename F::Complex*>(data);
  auto* real = reinterpret_cast<Real*>(data);
  cufftResult result = CUFFT_SUCCESS;
  switch (kind_) {
    case FftKind::kForward:
      result = F::kRun(plan_, complex, complex, CUFFT_FORWARD);
      break;
    case FftKind::kBackward:
      result = F::kRun(plan_, complex, complex, CUFFT_INVERSE);
      break;
    case FftKind::kRealToComplex:
      result = F::kRunReal(plan_, real, complex);
      break;
    case FftKind::kComplexToReal:
      result = F::kRunBack(plan_, complex, real);
      break;
  }
  if (result != CUFFT_SUCCESS) {
    throw NumericsError("CUDA: a Fourier transform failed with cuFFT's error " +
                        std::to_string(static_cast<int>(result)));
  }
}

template class DeviceFft<float>;
template class DeviceFft<double>;

}  // namespace breccia::cuda

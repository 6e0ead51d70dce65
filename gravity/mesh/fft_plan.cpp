#include "gravity/mesh/fft_plan.hpp"

#include <fftw3.h>

#include <string>
#include <utility>

#include "breccia/error.hpp"
#include "gravity/mesh/aligned.hpp"

namespace breccia::gravity {
namespace {

// FFTW's functions for each precision under one name.
template <class Real>
struct Fftw;

template <>
struct Fftw<float> {
  using Plan = fftwf_plan;
  using Complex = fftwf_complex;
  static constexpr auto kMany = fftwf_plan_many_dft;
  static constexpr auto kManyReal = fftwf_plan_many_dft_r2c;
  static constexpr auto kManyBack = fftwf_plan_many_dft_c2r;
  static constexpr auto kRun = fftwf_execute_dft;
  static constexpr auto kRunReal = fftwf_execute_dft_r2c;
  static constexpr auto kRunBack = fftwf_execute_dft_c2r;
  static constexpr auto kDestroy = fftwf_destroy_plan;
};

template <>
struct Fftw<double> {
  using Plan = fftw_plan;
  using Complex = fftw_complex;
  static constexpr auto kMany = fftw_plan_many_dft;
  static constexpr auto kManyReal = fftw_plan_many_dft_r2c;
  static constexpr auto kManyBack = fftw_plan_many_dft_c2r;
  static constexpr auto kRun = fftw_execute_dft;
  static constexpr auto kRunReal = fftw_execute_dft_r2c;
  static constexpr auto kRunBack = fftw_execute_dft_c2r;
  static constexpr auto kDestroy = fftw_destroy_plan;
};

// Estimated, not measured: a plan chosen by the clock would change the last bits from run to run.
constexpr unsigned kFlags = FFTW_ESTIMATE;

template <class Real>
void* make_plan(FftKind kind, int length, int count, int stride, int distance) {
  using F = Fftw<Real>;
  const auto points = static_cast<std::size_t>(length - 1) * static_cast<std::size_t>(stride) +
                      static_cast<std::size_t>(count - 1) * static_cast<std::size_t>(distance) + 1;
  AlignedVector<std::complex<Real>> data(points);
  auto* complex = reinterpret_cast<typename F::Complex*>(data.data());
  auto* real = reinterpret_cast<Real*>(data.data());
  switch (kind) {
    case FftKind::kForward:
    case FftKind::kBackward:
      return F::kMany(1, &length, count, complex, nullptr, stride, distance, complex, nullptr, stride, distance,
                      kind == FftKind::kForward ? FFTW_FORWARD : FFTW_BACKWARD, kFlags);
    case FftKind::kRealToComplex:
      return F::kManyReal(1, &length, count, real, nullptr, 1, 2 * distance, complex, nullptr, 1, distance, kFlags);
    case FftKind::kComplexToReal:
      return F::kManyBack(1, &length, count, complex, nullptr, 1, distance, real, nullptr, 1, 2 * distance, kFlags);
  }
  return nullptr;
}

}  // namespace

template <class Real>
FftPlan<Real>::FftPlan(FftKind kind, int length, int count, int stride, int distance) : kind_(kind) {
  if (length > 0 && count > 0) plan_ = make_plan<Real>(kind, length, count, stride, distance);
  if (plan_ == nullptr) throw UsageError("gravity mesh: no Fourier transform of length " + std::to_string(length));
}

template <class Real>
FftPlan<Real>::FftPlan(FftPlan&& other) noexcept : kind_(other.kind_), plan_(std::exchange(other.plan_, nullptr)) {}

template <class Real>
FftPlan<Real>::~FftPlan() {
  if (plan_ != nullptr) Fftw<Real>::kDestroy(static_cast<typename Fftw<Real>::Plan>(plan_));
}

template <class Real>
void FftPlan<Real>::operator()(Complex* data) const {
  using F = Fftw<Real>;
  auto* plan = static_cast<typename F::Plan>(plan_);
  auto* complex = reinterpret_cast<typename F::Complex*>(data);
  auto* real = reinterpret_cast<Real*>(data);
  switch (kind_) {
    case FftKind::kForward:
    case FftKind::kBackward:
      F::kRun(plan, complex, complex);
      break;
    case FftKind::kRealToComplex:
      F::kRunReal(plan, real, complex);
      break;
    case FftKind::kComplexToReal:
      F::kRunBack(plan, complex, real);
      break;
  }
}

template class FftPlan<float>;
template class FftPlan<double>;

const char* fft_library() { return fftwf_version; }

int fft_friendly_length(int least) {
  for (int length = least < 2 ? 2 : least + least % 2;; length += 2) {
    int rest = length;
    for (const int prime : {2, 3, 5, 7}) {
      while (rest % prime == 0) rest /= prime;
    }
    if (rest == 1) return length;
  }
}

}  // namespace breccia::gravity

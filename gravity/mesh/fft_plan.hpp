// The one place that knows the FFT library: batched one-dimensional transforms in place. Everything the mesh needs is
// built of these, so that another library (or cuFFT, whose "plan many" has the same parameters) replaces one file.
#pragma once

#include <complex>
#include <cstddef>

namespace breccia::gravity {

enum class FftKind {
  kForward,        ///< complex, exponent -
  kBackward,       ///< complex, exponent +
  kRealToComplex,  ///< `length` reals become length/2 + 1 complex numbers, exponent -
  kComplexToReal,  ///< and back, exponent +
};

/// `count` transforms of `length` points, unnormalised, in place. Point k of transform j is element j * distance +
/// k * stride of the complex array; the reals of a real transform (stride 1 only) start where its complex numbers do.
/// The same plan and data give the same bits in every run. Throws UsageError if the library refuses.
template <class Real>
class FftPlan {
 public:
  using Complex = std::complex<Real>;

  FftPlan(FftKind kind, int length, int count, int stride, int distance);
  ~FftPlan();
  FftPlan(FftPlan&& other) noexcept;
  FftPlan(const FftPlan&) = delete;
  FftPlan& operator=(const FftPlan&) = delete;
  FftPlan& operator=(FftPlan&&) = delete;

  /// `data` is aligned to kFftAlignment. Different threads may transform different arrays at once.
  void operator()(Complex* data) const;

 private:
  FftKind kind_;
  void* plan_ = nullptr;
};

/// Bytes that the arrays to be transformed are aligned to.
inline constexpr std::size_t kFftAlignment = 64;

/// Name and version of the FFT library.
const char* fft_library();

/// The smallest even length >= `least` with no prime factor above 7.
int fft_friendly_length(int least);

}  // namespace breccia::gravity

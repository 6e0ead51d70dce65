// The one place that knows cuFFT, as gravity/mesh/fft_plan.hpp is for the host: transforms in place of data on the
// device.
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

#include "cuda/fft_library.hpp"
#include "gravity/mesh/fft_plan.hpp"

namespace breccia::cuda {

/// `count` transforms over one or two axes of `lengths`, unnormalised. Along one axis point k of transform j is element
/// j * distance + k * stride of the complex array. Over two axes a transform is rows that follow each other; stride
/// is 1. The reals of a row start where its complex numbers do.
struct FftLayout {
  std::vector<int> lengths;
  int count = 0;  ///< 0: nothing
  int stride = 1;
  int distance = 0;
};

template <class Real>
class DeviceFft {
 public:
  using Complex = std::complex<Real>;

  /// Without a work area. Throws UsageError if the library refuses.
  DeviceFft(gravity::FftKind kind, const FftLayout& layout, cudaStream_t stream);
  ~DeviceFft();
  DeviceFft(const DeviceFft&) = delete;
  DeviceFft& operator=(const DeviceFft&) = delete;

  /// Bytes of the work area that it needs, which transforms that follow each other on a stream may share.
  [[nodiscard]] std::size_t work_bytes() const { return work_bytes_; }
  void use_work_area(std::byte* area);

  /// Enqueues the transforms of `data`, on the device.
  void operator()(Complex* data) const;

 private:
  gravity::FftKind kind_;
  bool empty_;
  cufftHandle plan_ = 0;
  std::size_t work_bytes_ = 0;
};

extern template class DeviceFft<float>;
extern template class DeviceFft<double>;

}  // namespace breccia::cuda

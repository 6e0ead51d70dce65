// Potential of a mesh of masses with vacuum around it, on the devices: gravity/mesh/convolution.hpp with transforms
// over y and z in one call. Planes of x are dealt out to the ranks; two transpositions pass through pinned host memory.
#pragma once

#include <vector>

#include "cuda/device_array.hpp"
#include "cuda/device_fft.hpp"
#include "cuda/mesh_kernels.hpp"
#include "gravity/mesh/convolution.hpp"

namespace breccia::cuda {

template <class Real>
class DeviceConvolution {
 public:
  using Complex = std::complex<Real>;

  /// Collective over `comm`.
  DeviceConvolution(const gravity::MeshSize& size, const gravity::Kernel& kernel, const mpi::Comm& comm,
                    cudaStream_t stream);

  /// The planes this rank is to fill with masses, zero beyond the nodes. They are lost in apply().
  [[nodiscard]] MeshPlanes<Real> masses() const;
  /// Masses to potential. Collective.
  void apply();
  /// At all nodes, after apply().
  [[nodiscard]] MeshPlanes<const Real> potential() const;

  /// Bytes this rank sends in one call.
  [[nodiscard]] double bytes_sent() const { return bytes_sent_; }

 private:
  void share_work_area();
  void make_kernel(const gravity::Kernel& kernel);
  void exchange(const Complex* send, const std::vector<int>& send_counts, Complex* receive,
                const std::vector<int>& receive_counts);
  // Complex numbers from each rank's own planes to each other's wave numbers of y.
  [[nodiscard]] std::vector<int> counts_by_x() const;
  [[nodiscard]] std::vector<int> counts_by_y() const;
  void transpose_to_y();
  void transpose_to_x();
  void share_potential();
  [[nodiscard]] Complex* by_y() const { return comm_.size() > 1 ? by_y_.data() : by_x_.data(); }
  [[nodiscard]] gravity::PlaneRange own_x() const { return x_[static_cast<std::size_t>(comm_.rank())]; }
  [[nodiscard]] gravity::PlaneRange own_y() const { return y_[static_cast<std::size_t>(comm_.rank())]; }

  gravity::MeshSize size_;
  mpi::Comm comm_;
  cudaStream_t stream_;
  int half_;  // complex numbers along z
  std::vector<gravity::PlaneRange> x_, y_;
  DeviceFft<Real> to_yz_, from_yz_, to_x_, from_x_;
  DeviceArray<std::byte> work_area_;  // of all four
  int first_folded_ = 0;
  double bytes_sent_ = 0.0;
  DeviceArray<Real> kernel_;     // (folded y wave number from first_folded_, x wave number to padded/2, half)
  DeviceArray<Complex> by_x_;    // (own x, padded y, half); on one rank all of padded x
  DeviceArray<Complex> by_y_;    // (padded x, own y, half); not used on one rank
  DeviceArray<Real> own_nodes_;  // potential at the nodes of own planes
  DeviceArray<Real> potential_;  // at all nodes; neither is used on one rank
  PinnedArray<Complex> leaving_, arrived_;
};

extern template class DeviceConvolution<float>;
extern template class DeviceConvolution<double>;

}  // namespace breccia::cuda

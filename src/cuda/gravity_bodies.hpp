// The point masses of all ranks in the memory of each device.
#pragma once

#include "cuda/device_array.hpp"
#include "cuda/gravity_kernels.hpp"
#include "mpi/comm.hpp"

namespace breccia::cuda {

template <class Real>
class GravityBodies {
 public:
  GravityBodies(const mpi::Comm& comm, cudaStream_t stream) : comm_(comm), stream_(stream) {}

  /// Predicts this rank's particles and fetches those of the others, by way of pinned host memory. Collective.
  void gather(const PredictArguments<Real>& own);

  /// Frees what gather() has taken of the device.
  void forget();

  /// In the order of the ranks.
  [[nodiscard]] BodyArrays all() const;
  /// This rank's are [first, first + own) of them.
  [[nodiscard]] unsigned first() const { return first_; }
  [[nodiscard]] unsigned own() const { return own_; }
  [[nodiscard]] double bytes_sent() const { return bytes_sent_; }
  /// This rank's.
  [[nodiscard]] BodyArrays own_bodies() const;
  /// Of all ranks. The host waits.
  [[nodiscard]] Extremes extremes();

 private:
  void exchange();

  mpi::Comm comm_;
  cudaStream_t stream_;
  unsigned first_ = 0, own_ = 0, all_ = 0;
  double bytes_sent_ = 0.0;
  DeviceArray<double> predicted_;  // [4][own]
  DeviceArray<double> gathered_;   // [4][all]; not used on one rank
  PinnedArray<double> sent_, received_;
  DeviceArray<Extremes> extremes_;
};

extern template class GravityBodies<float>;
extern template class GravityBodies<double>;

}  // namespace breccia::cuda

// What the bodies of one box do to each other, on the device: long-range part from a mesh, short-range part from pairs
// (gravity/mesh/box_field.hpp).
#pragma once

#include <memory>

#include "cuda/device_convolution.hpp"
#include "cuda/primitives.hpp"
#include "gravity/mesh/box_field.hpp"

namespace breccia::cuda {

template <class Real>
class BoxGravity {
 public:
  BoxGravity(const mpi::Comm& comm, cudaStream_t stream) : comm_(comm), stream_(stream) {}

  /// Adds the field of `bodies`, of all ranks, to acceleration[3][own] [m/s2] of those that are this rank's: [first,
  /// first + own) of the bodies of all ranks. Mesh and kernel are kept while size and settings stay. Collective; the
  /// host waits for the count of pairs.
  void add_field(const BodyArrays& bodies, const gravity::BoxSettings& settings, unsigned first, unsigned own,
                 double* acceleration, gravity::Stats& stats);

 private:
  void prepare_mesh(const gravity::MeshSize& size, const gravity::GaussianSplit& split);
  void sort(const BodyArrays& bodies, const gravity::BoxSettings& settings, unsigned first, unsigned own);
  void add_mesh_field(double unit, unsigned own, double* acceleration, gravity::Phases& phases);
  void add_near_field(double unit, unsigned own, double* acceleration, gravity::Stats& stats);
  [[nodiscard]] Clusters<Real> clusters() const;
  [[nodiscard]] MeshBodies bodies() const;

  mpi::Comm comm_;
  cudaStream_t stream_;
  MeshNodes nodes_;
  gravity::MeshSize size_{};
  gravity::GaussianSplit split_;
  gravity::ShortRange<Real> law_{};
  std::unique_ptr<DeviceConvolution<Real>> convolution_;
  PrimitiveScratch scratch_;
  unsigned count_ = 0;  // of bodies
  unsigned most_clusters_ = 0;
  DeviceArray<std::uint64_t> keys_;
  DeviceArray<unsigned> order_, target_, first_, cluster_first_;
  DeviceArray<double> sorted_;  // [4][bodies]
  DeviceArray<Cluster<Real>> clusters_;
  DeviceArray<NodeField<Real>> field_;  // at the nodes
  DeviceArray<unsigned long long> pairs_;
};

extern template class BoxGravity<float>;
extern template class BoxGravity<double>;

}  // namespace breccia::cuda

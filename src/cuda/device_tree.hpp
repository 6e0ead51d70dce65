// A tree of gravity over bodies of all ranks, built and kept in device memory. It is the tree of the host
// (gravity/tree/tree.hpp), cell by cell, on any number of ranks.
#pragma once

#include <vector>

#include "cuda/device_array.hpp"
#include "cuda/primitives.hpp"
#include "cuda/tree_kernels.hpp"
#include "mpi/comm.hpp"

namespace breccia::cuda {

class DeviceTree {
 public:
  DeviceTree(const mpi::Comm& comm, cudaStream_t stream) : comm_(comm), stream_(stream) {}

  /// Sorts the bodies and grows the tree; of the bodies of all ranks [first, first + own) are this rank's. The host
  /// waits once for each level.
  void build(const BodyArrays& bodies, const gravity::Root& root, double mass_unit, unsigned first, unsigned own);
  /// Weighs the cells by gravity::acceleration_scales().
  void weigh(const OtherRoots& others, double softening);

  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] TreeView view() const;
  [[nodiscard]] SortedBodies bodies() const;

 private:
  void sort(const BodyArrays& bodies, const gravity::Root& root, double mass_unit, unsigned first, unsigned own);
  void grow();
  void make_room(unsigned cells);
  void share_scales();

  mpi::Comm comm_;
  cudaStream_t stream_;
  unsigned count_ = 0;  // of bodies
  unsigned cells_in_use_ = 0;
  std::vector<Level> levels_;
  PrimitiveScratch scratch_;
  DeviceArray<std::uint64_t> keys_;
  DeviceArray<unsigned> order_, own_before_;
  DeviceArray<double> sorted_;  // [4][bodies]
  DeviceArray<gravity::Cell> cells_;
  DeviceArray<std::int32_t> next_;
  DeviceArray<Role> role_;
  DeviceArray<double> scale_;
  DeviceArray<HeavyCells> heavy_;
  DeviceArray<unsigned> children_;
  DeviceArray<std::int32_t> bounds_, bits_;
};

}  // namespace breccia::cuda

// The bodies of all ranks dealt out to sets: outside of all boxes, and inside each (gravity/mesh/box.hpp).
#pragma once

#include <span>
#include <vector>

#include "cuda/device_array.hpp"
#include "cuda/gravity_kernels.hpp"
#include "cuda/primitives.hpp"
#include "gravity/mesh/box.hpp"

namespace breccia::cuda {

class BodySets {
 public:
  explicit BodySets(cudaStream_t stream) : stream_(stream) {}

  /// Set 0 lies outside of all boxes, set k in boxes[k - 1]; in each the bodies keep their order. The host waits.
  void divide(const BodyArrays& all, std::span<const gravity::Box> boxes);

  [[nodiscard]] std::span<const BodyArrays> sets() const { return sets_; }

 private:
  cudaStream_t stream_;
  PrimitiveScratch scratch_;
  DeviceArray<std::uint64_t> keys_;
  DeviceArray<unsigned> order_, first_;
  DeviceArray<double> bodies_;  // [4][all]
  std::vector<BodyArrays> sets_;
};

}  // namespace breccia::cuda

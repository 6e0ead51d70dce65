// The field of a tree's bodies at those of this rank in a tree, on the device: the walk of gravity/tree/walk.hpp,
// depth by depth.
#pragma once

#include "cuda/device_tree.hpp"

namespace breccia::cuda {

template <class Real>
class TreeGravity {
 public:
  explicit TreeGravity(cudaStream_t stream) : stream_(stream) {}

  struct Settings {
    double tolerance;     ///< gravity::opening_for()
    double softening;     ///< in Root::unit
    unsigned first, own;  ///< this rank's among the bodies of all ranks
    double unit;          ///< of accelerations [m/s2]
  };
  void clear_counts();
  /// Adds the field of `sources` to acceleration[3][own] of the bodies in `targets`, the same tree or another one of
  /// the same root. The host waits twice for each depth.
  void add_field(const DeviceTree& targets, const DeviceTree& sources, const Settings& settings, double* acceleration);

  /// Of all fields since they were cleared. The host waits.
  [[nodiscard]] WalkCounts counts() const { return counts_.download(1, stream_)[0]; }

 private:
  // The arrays of a step; two of them take turns.
  struct Front {
    unsigned targets = 0, pairs = 0;
    DeviceArray<WalkTarget> target;
    DeviceArray<unsigned> pair_first;
    DeviceArray<FarField> far;
  };
  struct List {
    DeviceArray<unsigned> first;
    DeviceArray<std::int32_t> cell;
  };

  void start(Front& front);
  [[nodiscard]] WalkStep step_of(const DeviceTree& targets, const DeviceTree& sources, const Settings& settings,
                                 const Front& front);
  // Number of listed leaves.
  unsigned place_candidates(WalkStep& step);
  void sum_groups(const WalkStep& step, unsigned leaves, const DeviceTree& targets, const DeviceTree& sources,
                  const Settings& settings, double* acceleration);
  void descend(const WalkStep& step, Front& next);

  cudaStream_t stream_;
  PrimitiveScratch scratch_;
  Front fronts_[2];
  List lists_[kLists];
  DeviceArray<std::int32_t> candidates_;  // what the step before left
  DeviceArray<unsigned> leaf_first_, child_first_, child_pairs_;
  DeviceArray<WalkCounts> counts_;
};

extern template class TreeGravity<float>;
extern template class TreeGravity<double>;

}  // namespace breccia::cuda

// Pairs of bodies by the whole law, summed over trees: one for each set, so that no cell lies across the border of a
// box (gravity/tree/unsplit.hpp, on the device).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "cuda/tree_gravity.hpp"
#include "gravity/solver.hpp"

namespace breccia::cuda {

template <class Real>
class UnsplitGravity {
 public:
  UnsplitGravity(const mpi::Comm& comm, cudaStream_t stream) : comm_(comm), stream_(stream), walk_(stream) {}

  struct Settings {
    gravity::Root root;
    double mass_unit;     ///< [kg]
    double softening;     ///< [m]
    double tolerance;     ///< gravity::opening_for()
    unsigned first, own;  ///< this rank's among the bodies of all ranks
  };
  /// Adds the field that bodies of set 0 feel from all, those of set k from all that are not in set k, to
  /// acceleration[3][own] [m/s2].
  void add_field(std::span<const BodyArrays> sets, const Settings& settings, double* acceleration,
                 gravity::Stats& stats);

 private:
  void grow_trees(std::span<const BodyArrays> sets, const Settings& settings);
  void weigh_cells(double softening);

  mpi::Comm comm_;
  cudaStream_t stream_;
  std::vector<std::unique_ptr<DeviceTree>> trees_;  // of the sets
  TreeGravity<Real> walk_;
};

extern template class UnsplitGravity<float>;
extern template class UnsplitGravity<double>;

}  // namespace breccia::cuda

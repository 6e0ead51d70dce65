// Self-gravity on the device, from the particles of the engine to the accelerations that they hold. On one rank nothing
// of a particle passes through the host.
#pragma once

#include <functional>

#include "cuda/body_sets.hpp"
#include "cuda/box_gravity.hpp"
#include "cuda/device_census.hpp"
#include "cuda/gravity_bodies.hpp"
#include "cuda/unsplit_gravity.hpp"
#include "gravity/mesh/layout.hpp"
#include "gravity/resident.hpp"

namespace breccia::cuda {

template <class Real>
class CudaGravity final : public gravity::ResidentSolver {
 public:
  using Particles = std::function<PredictArguments<Real>(double time)>;

  CudaGravity(GravityMethod method, const gravity::Parameters& parameters, Particles particles, const mpi::Comm& comm,
              cudaStream_t stream);

  /// Throws UsageError on all ranks if the device has not the memory that an evaluation takes with the particles where
  /// they are. Collective.
  void require_memory();
  void evaluate_and_hold(double time) override;
  [[nodiscard]] const gravity::Stats& last() const override { return stats_; }

 private:
  [[nodiscard]] gravity::Layout lay_boxes(double heaviest);
  [[nodiscard]] bool needs_boxes(std::uint64_t particles) const;
  // The method to use for so many particles of all ranks; lays boxes where that or the choice needs them.
  // None is heavier than `heaviest` [kg].
  [[nodiscard]] gravity::MethodChoice choose_method(std::uint64_t particles, double heaviest, gravity::Layout& layout);
  void sum_directly(double mass_unit);
  void sum_unsplit(std::span<const BodyArrays> sets, const Extremes& extremes, double mass_unit);
  void sum_by_mesh(const gravity::Layout& layout, const Extremes& extremes, double mass_unit);
  Vec3d net_force(const PredictArguments<Real>& own);

  GravityMethod method_;
  gravity::Parameters parameters_;
  Particles particles_;
  mpi::Comm comm_;
  cudaStream_t stream_;
  gravity::Stats stats_;
  GravityBodies<Real> bodies_;
  DeviceCensus census_;
  BodySets sets_;
  std::vector<std::unique_ptr<BoxGravity<Real>>> boxes_;  // those that there ever were
  UnsplitGravity<Real> unsplit_;
  DeviceArray<double> acceleration_;  // [3][own] [m/s2]
  DeviceArray<double> scratch_;
  DeviceArray<NetForce> net_forces_;
};

extern template class CudaGravity<float>;
extern template class CudaGravity<double>;

}  // namespace breccia::cuda

// Self-gravity on the device, from the particles of the engine to the accelerations that they hold. On one rank nothing
// of a particle passes through the host.
#pragma once

#include <functional>

#include "cuda/body_sets.hpp"
#include "cuda/box_gravity.hpp"
#include "cuda/gravity_bodies.hpp"
#include "cuda/unsplit_gravity.hpp"
#include "gravity/resident.hpp"

namespace breccia::cuda {

/// kAuto sums directly up to so many particles of all ranks, and takes the tree beyond. An estimate from the rates of
/// arithmetic: at this many the direct sum takes an H100 some 10 ms a window, and keeps the momentum of each body.
inline constexpr std::uint64_t kMostDirect = 100'000;

template <class Real>
class CudaGravity final : public gravity::ResidentSolver {
 public:
  using Particles = std::function<PredictArguments<Real>(double time)>;

  CudaGravity(GravityMethod method, const gravity::Parameters& parameters, Particles particles, const mpi::Comm& comm,
              cudaStream_t stream);

  void evaluate_and_hold(double time) override;
  [[nodiscard]] const gravity::Stats& last() const override { return stats_; }

 private:
  void choose_method(unsigned particles);
  void sum_directly(double mass_unit);
  void sum_unsplit(std::span<const BodyArrays> sets, const Extremes& extremes, double mass_unit);
  void sum_by_mesh(const Extremes& extremes, double mass_unit);
  Vec3d net_force(const PredictArguments<Real>& own);

  GravityMethod method_;
  gravity::Parameters parameters_;
  Particles particles_;
  mpi::Comm comm_;
  cudaStream_t stream_;
  gravity::Stats stats_;
  GravityBodies<Real> bodies_;
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

// Every pair, summed: the reference for all other solvers and the cheapest one below some thousand particles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "gravity/points.hpp"
#include "gravity/solver.hpp"

namespace breccia::gravity {

/// Plummer-softened direct summation. Mixed precision: float pair arithmetic on exact coordinate differences, float
/// sums over some hundred sources, double sums of those. The particles of the ranks go round in a ring while each rank
/// sums over those it holds. Coincident particles exert no force on each other; without softening, no potential either.
class DirectSum final : public Solver {
 public:
  DirectSum(const Parameters& parameters, const mpi::Comm& comm, int threads);

  void evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) override;
  [[nodiscard]] const Stats& last() const override { return stats_; }
  [[nodiscard]] std::span<const double> work() const override { return work_; }

 private:
  /// Targets, and the two ends of the ring: what this rank sums over and what arrives meanwhile.
  template <class Real>
  struct Ring {
    Points<Real> own, here, arriving;
  };

  template <class Real>
  void sum_over_ring(Ring<Real>& ring, ParticlesView particles, double mass_unit);
  template <class Real>
  void sum_over_sources(const Points<Real>& own, const Points<Real>& sources, bool same,
                        std::array<MPI_Request, 2>& in_flight);
  void write(ParticlesView particles, double mass_unit, std::span<Vec3d> acceleration, std::span<double> potential);

  Parameters parameters_;
  mpi::Comm comm_;
  int threads_;
  Stats stats_;
  Ring<float> float_ring_;
  Ring<double> double_ring_;
  std::vector<double> work_;
  std::vector<double> sums_[4];  ///< acceleration and potential in units of G times the mass unit
};

}  // namespace breccia::gravity

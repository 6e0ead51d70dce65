// Gravity by a tree: cost grows with the number of particles, error with the tolerance.
#pragma once

#include "gravity/solver.hpp"
#include "gravity/tree/tree.hpp"
#include "gravity/tree/walk.hpp"

namespace breccia::gravity {

/// Dual-tree walk with local expansions of the fourth order (gravity.md 5.3). One field is the same to rounding on any
/// number of ranks and, bit for bit, on any number of threads. The net force the approximation leaves is subtracted
/// from all accelerations.
class TreeSolver final : public Solver {
 public:
  TreeSolver(const Parameters& parameters, const mpi::Comm& comm, int threads);

  void evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) override;
  [[nodiscard]] const Stats& last() const override { return stats_; }

 private:
  void write(double unit, double length, std::span<Vec3d> acceleration, std::span<double> potential) const;

  Parameters parameters_;
  mpi::Comm comm_;
  int threads_;
  Stats stats_;
  Tree tree_;
  FieldSums sums_;
};

}  // namespace breccia::gravity

// Gravity by a tree: cost grows with the number of particles, error with the tolerance.
#pragma once

#include "gravity/solver.hpp"
#include "gravity/tree/unsplit.hpp"

namespace breccia::gravity {

/// Dual-tree walk with local expansions of the fourth order (gravity.md 5.3) over all particles as one set. The net
/// force the approximation leaves is taken off the particles.
class TreeSolver final : public Solver {
 public:
  TreeSolver(const Parameters& parameters, const mpi::Comm& comm, int threads);

  void evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) override;
  [[nodiscard]] const Stats& last() const override { return stats_; }
  [[nodiscard]] std::span<const double> work() const override { return work_; }

 private:
  mpi::Comm comm_;
  Stats stats_;
  UnsplitField field_;
  std::vector<double> work_;
};

}  // namespace breccia::gravity

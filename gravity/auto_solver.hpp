// Takes, at each evaluation, the cheapest method that is accurate enough.
#pragma once

#include "gravity/direct_sum.hpp"
#include "gravity/tree/tree_solver.hpp"

namespace breccia::gravity {

/// Direct sum or tree, by the number of particles of all ranks.
class AutoSolver final : public Solver {
 public:
  AutoSolver(const Parameters& parameters, const mpi::Comm& comm, int threads)
      : parameters_(parameters), comm_(comm), direct_(parameters, comm, threads), tree_(parameters, comm, threads) {}

  void evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) override;
  [[nodiscard]] const Stats& last() const override { return used_->last(); }

 private:
  Parameters parameters_;
  mpi::Comm comm_;
  DirectSum direct_;
  TreeSolver tree_;
  Solver* used_ = &direct_;
};

}  // namespace breccia::gravity

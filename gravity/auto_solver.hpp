// Takes, at each evaluation, the cheapest method that is accurate enough.
#pragma once

#include <algorithm>

#include "gravity/direct_sum.hpp"
#include "gravity/mesh/tree_pm.hpp"
#include "gravity/tree/tree_solver.hpp"

namespace breccia::gravity {

/// Direct sum, tree or particle mesh, by what cheapest_method() says of the particles of all ranks. The boxes found for
/// the choice are those the mesh then uses; where the tree is chosen nothing else of the mesh is paid.
template <class Real>
class AutoSolver final : public Solver {
 public:
  AutoSolver(const Parameters& parameters, const mpi::Comm& comm, int threads)
      : parameters_(parameters),
        comm_(comm),
        threads_(std::max(threads, 1)),
        direct_(parameters, comm, threads),
        tree_(parameters, comm, threads),
        mesh_(parameters, comm, threads) {}

  void evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) override;
  [[nodiscard]] const Stats& last() const override { return stats_; }
  [[nodiscard]] std::span<const double> work() const override { return used_->work(); }

 private:
  Parameters parameters_;
  mpi::Comm comm_;
  int threads_;
  DirectSum direct_;
  TreeSolver tree_;
  TreePm<Real> mesh_;
  const Solver* used_ = &direct_;
  Stats stats_;
};

}  // namespace breccia::gravity

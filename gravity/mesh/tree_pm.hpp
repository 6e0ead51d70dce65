// Particle mesh and short-range pairs inside boxes around the dense bodies, unsplit sums for all other pairs
// (gravity.md 5.2): a pair is split only if both particles are in the same box.
#pragma once

#include <vector>

#include "gravity/mesh/box_field.hpp"
#include "gravity/mesh/layout.hpp"
#include "gravity/solver.hpp"
#include "gravity/tree/unsplit.hpp"

namespace breccia::gravity {

template <class Real>
class TreePm final : public Solver {
 public:
  TreePm(const Parameters& parameters, const mpi::Comm& comm, int threads);

  void evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) override;
  /// The same with boxes already chosen by lay_boxes().
  void evaluate_in(const Layout& layout, ParticlesView particles, std::span<Vec3d> acceleration,
                   std::span<double> potential);
  [[nodiscard]] const Stats& last() const override { return stats_; }
  [[nodiscard]] std::span<const double> work() const override { return work_; }

 private:
  Parameters parameters_;
  mpi::Comm comm_;
  int threads_;
  Stats stats_;
  std::vector<BoxField<Real>> fields_;
  UnsplitField unsplit_;
  std::vector<double> work_;
};

}  // namespace breccia::gravity

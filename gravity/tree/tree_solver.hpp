// Gravity by a tree: cost grows with the number of particles, error with the tolerance.
#pragma once

#include "gravity/solver.hpp"
#include "gravity/tree/interactions.hpp"
#include "gravity/tree/tree.hpp"
#include "gravity/tree/walk.hpp"

namespace breccia::gravity {

/// Parameters::opening, or what leaves Parameters::error.
double opening_for(const Parameters& parameters);

/// Dual-tree walk with local expansions of the fourth order (gravity.md 5.3). Every rank holds all particles and sums
/// the field of its share of them, a stretch of the Morton curve whatever the slabs of the caller: the tree, and with
/// it the field, is then the same to rounding on any number of ranks (bit for bit on any number of threads), and the
/// work is even. The net force the approximation leaves is taken off the particles.
class TreeSolver final : public Solver {
 public:
  TreeSolver(const Parameters& parameters, const mpi::Comm& comm, int threads);

  void evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) override;
  [[nodiscard]] const Stats& last() const override { return stats_; }

 private:
  void build(const Root& root, ParticlesView particles, double mass_unit);
  void take_share();
  void walk_share(double softening);
  void share_sums();
  void write(std::int64_t first, double unit, double length, std::span<Vec3d> acceleration,
             std::span<double> potential) const;

  Parameters parameters_;
  mpi::Comm comm_;
  int threads_;
  Stats stats_;
  Tree tree_;
  Range share_{};  ///< this rank's targets among the sorted particles
  FieldSums sums_;
};

}  // namespace breccia::gravity

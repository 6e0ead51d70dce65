// What all solvers do before and after they sum.
#pragma once

#include <span>

#include "gravity/solver.hpp"

namespace breccia::gravity {

/// Throws UsageError unless positions, masses, accelerations and potentials (or none) are equally many.
void check_sizes(ParticlesView particles, std::span<const Vec3d> acceleration, std::span<const double> potential);

/// Largest mass of all ranks [kg], 1 where there is none.
double heaviest(std::span<const double> mass, const mpi::Comm& comm);

/// Sets momentum_error: |sum(m a)| / sum(m |a|) over the ranks.
void book_momentum(ParticlesView particles, std::span<const Vec3d> acceleration, const mpi::Comm& comm, Stats& stats);

/// The same, and takes the net force off the particles in proportion to m |a|: far debris that feels little is then
/// disturbed as little, while an equal acceleration of all would drown its own.
void remove_net_force(ParticlesView particles, std::span<Vec3d> acceleration, const mpi::Comm& comm, Stats& stats);

/// Fields of this rank's particles, to which the parts of a solver add.
struct FieldView {
  std::span<Vec3d> acceleration;  ///< [m/s2]
  std::span<double> potential;    ///< [J/kg]; empty: not wanted
  std::span<double> work;         ///< Solver::work()
};

/// Adds the wall time of its lifetime to `seconds`.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds), start_(MPI_Wtime()) {}
  ~Stopwatch() { seconds_ += MPI_Wtime() - start_; }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& seconds_;
  double start_;
};

}  // namespace breccia::gravity

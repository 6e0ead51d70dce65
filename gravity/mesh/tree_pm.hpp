// Particle mesh and short-range pairs inside boxes around the dense bodies, unsplit sums for all other pairs
// (gravity.md 5.2): a pair is split only if both particles are in the same box.
#pragma once

#include <vector>

#include "gravity/mesh/box_field.hpp"
#include "gravity/mesh/boxes.hpp"
#include "gravity/mesh/unsplit.hpp"
#include "gravity/solver.hpp"

namespace breccia::gravity {

template <class Real>
class TreePm final : public Solver {
 public:
  TreePm(const Parameters& parameters, const mpi::Comm& comm, int threads);

  void evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) override;
  [[nodiscard]] const Stats& last() const override { return stats_; }

 private:
  void choose(ParticlesView particles);

  Parameters parameters_;
  mpi::Comm comm_;
  int threads_;
  Stats stats_;
  double spacing_ = 0.0;  // mean distance of the particles where they are dense [m]
  double cell_ = 0.0;     // [m]
  std::vector<Box> boxes_;
  std::vector<std::uint8_t> set_;  // of each particle: 0 outside, k in box k - 1
  std::vector<BoxField<Real>> fields_;
  UnsplitField unsplit_;
};

}  // namespace breccia::gravity

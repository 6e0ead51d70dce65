// Pairs that are not in one mesh box, by the whole law.
#pragma once

#include <cstdint>
#include <span>

#include "gravity/points.hpp"
#include "gravity/solver.hpp"

namespace breccia::gravity {

/// Sets of particles: 0 outside of all boxes, k inside box k. Particles of set 0 feel all others, those of set k feel
/// all that are not in set k.
class UnsplitField {
 public:
  UnsplitField(const Parameters& parameters, const mpi::Comm& comm, int threads)
      : parameters_(parameters), comm_(comm), threads_(threads) {}

  /// Adds that field [m/s2, J/kg]. Collective.
  void add_to(ParticlesView particles, std::span<const std::uint8_t> set, int sets, double mass_unit,
              std::span<Vec3d> acceleration, std::span<double> potential, Stats& stats);

 private:
  Parameters parameters_;
  mpi::Comm comm_;
  int threads_;
};

}  // namespace breccia::gravity

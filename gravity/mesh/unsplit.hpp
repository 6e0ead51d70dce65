// Pairs that are not in one mesh box, by the whole law: a tree of its own for each set of particles, so that no cell
// lies across the border of a box (gravity.md 5.2).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gravity/solver.hpp"
#include "gravity/tree/tree.hpp"
#include "gravity/tree/walk.hpp"

namespace breccia::gravity {

/// Sets of particles: 0 outside of all boxes, k inside box k. Particles of set 0 feel all others, those of set k feel
/// all that are not in set k.
class UnsplitField {
 public:
  UnsplitField(const Parameters& parameters, const mpi::Comm& comm, int threads)
      : parameters_(parameters), comm_(comm), threads_(threads) {}

  /// Adds that field [m/s2, J/kg]. Every rank grows the trees of all ranks' particles and walks the parts that hold its
  /// own, so the field is the same on any number of ranks. Collective.
  void add_to(ParticlesView particles, std::span<const std::uint8_t> set, int sets, double mass_unit,
              std::span<Vec3d> acceleration, std::span<double> potential, Stats& stats);

 private:
  struct Set {
    Tree tree;
    std::vector<Vec3d> position;
    std::vector<double> mass;
    std::vector<std::int64_t> owned;  // index in the caller's arrays, -1 for particles of other ranks
    std::vector<double> scales;
    FieldSums sums;
  };

  void gather(ParticlesView particles, std::span<const std::uint8_t> set, Stats& stats);
  void grow_trees(double mass_unit, bool with_potential);
  void walk_all(std::size_t target, Stats& stats);

  Parameters parameters_;
  mpi::Comm comm_;
  int threads_;
  Root root_;
  std::vector<Set> sets_;
};

}  // namespace breccia::gravity

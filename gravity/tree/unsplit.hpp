// Pairs of particles by the whole law, summed over trees: one tree for each set of particles, so that no cell lies
// across the border of a box (gravity.md 5.2).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "gravity/evaluation.hpp"
#include "gravity/mesh/box.hpp"
#include "gravity/tree/shared_tree.hpp"
#include "gravity/tree/tolerance.hpp"

namespace breccia::gravity {

/// Sets of particles: 0 outside of all boxes, k inside box k. Particles of set 0 feel all others, those of set k feel
/// all that are not in set k. Each set has a tree that is the same on any number of ranks (SharedTree); what a rank
/// lacks of it for its own targets is imported before the walks, so the field is the same to rounding.
class UnsplitField {
 public:
  UnsplitField(const Parameters& parameters, const mpi::Comm& comm, int threads)
      : parameters_(parameters), comm_(comm), threads_(threads) {}

  /// Adds that field; an empty `set` stands for zeros. Collective.
  void add_to(ParticlesView particles, std::span<const std::uint8_t> set, int sets, double mass_unit,
              const FieldView& field, Stats& stats);

 private:
  struct Set {
    std::unique_ptr<SharedTree> tree;
    std::vector<Vec3d> position;
    std::vector<double> mass;
    std::vector<std::size_t> index;  // in the caller's arrays; empty for the only set
    FieldSums sums;
  };

  void select(ParticlesView particles, std::span<const std::uint8_t> set, int sets);
  void grow_trees(ParticlesView particles, double mass_unit, bool with_potential);
  void weigh_cells();
  void import_sources(Stats& stats);
  void walk_all(std::size_t target, Stats& stats);
  void write(Set& s, double mass_unit, const FieldView& field);

  Parameters parameters_;
  mpi::Comm comm_;
  int threads_;
  Root root_;
  double opening_ = 0.0;
  std::vector<Set> sets_;
};

}  // namespace breccia::gravity

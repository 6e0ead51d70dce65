// Particles sorted along a Morton curve and the tree of cells over them, built level by level without pointers.
//
// Cells split by up to three bits of the key, fewer where that is enough to reach the group or leaf size: groups and
// leaves then are filled to between half and all of their limit wherever the root cube happens to lie.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gravity/solver.hpp"
#include "gravity/tree/cell.hpp"
#include "gravity/tree/cell_moments.hpp"
#include "gravity/tree/morton.hpp"
#include "gravity/tree/radix_sort.hpp"
#include "gravity/tree/splitting.hpp"

namespace breccia::gravity {

/// Sorted particles, coordinates scaled (Root::scaled). What other ranks sent (SharedTree) follows and has no key and
/// no order.
struct SortedParticles {
  std::vector<double> x, y, z, mass;
  std::vector<std::uint64_t> key;
  std::vector<std::int64_t> order;  ///< index of each in the caller's arrays

  /// Those whose field is wanted here.
  [[nodiscard]] std::int64_t size() const { return static_cast<std::int64_t>(key.size()); }
  void append(Vec3d position, double m) {
    x.push_back(position.x);
    y.push_back(position.y);
    z.push_back(position.z);
    mass.push_back(m);
  }
  [[nodiscard]] Vec3d position(std::int64_t i) const {
    const auto k = static_cast<std::size_t>(i);
    return {x[k], y[k], z[k]};
  }
};

class Tree {
 public:
  /// Sorts the particles (masses in units of `mass_unit`) by their key in the root cube.
  void sort(const Root& root, ParticlesView particles, double mass_unit, int threads);

  /// The whole tree of these particles alone.
  void build(int threads);

  /// Splits the cells `frontier`, whose particles are here, down to leaves, and sets the moments of all new cells and
  /// of the frontier.
  void grow(std::span<const std::int32_t> frontier, int threads);

  /// Moments of an inner cell from its children, of a leaf from its particles.
  void set_moments(Cell& cell) const;
  /// Moments of an inner cell from its children, and a radius that is up to twice too large.
  void combine_children(Cell& cell) const;
  /// Square of the distance of the farthest of this rank's particles in the cell from its centre.
  [[nodiscard]] double farthest_squared(const Cell& cell) const;

  /// Cells whose particles share their interactions, in the order of their particles: the largest that are no
  /// more than kGroupParticles or cannot be split.
  [[nodiscard]] std::vector<std::int32_t> groups() const;

  [[nodiscard]] const Cell& cell(std::int32_t i) const { return cells[static_cast<std::size_t>(i)]; }
  [[nodiscard]] std::span<const Cell> children(const Cell& c) const {
    return std::span(cells).subspan(static_cast<std::size_t>(c.first_child), static_cast<std::size_t>(c.children));
  }

  SortedParticles particles;
  std::vector<Cell> cells;  ///< the root first; empty without particles
  std::int64_t all_particles = 0;

 private:
  std::vector<KeyedIndex> keyed_, scratch_;
};

/// Cube around particles in [low, high] with their coordinates shifted at random against it, so that the errors of
/// successive evaluations are not alike. The shift depends on the coordinates alone: a repeated run repeats it.
Root random_root(Vec3d low, Vec3d high);

}  // namespace breccia::gravity

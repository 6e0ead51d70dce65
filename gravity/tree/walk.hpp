// The field of one tree's particles at another's: a walk over pairs of cells.
#pragma once

#include <cstdint>
#include <vector>

#include "gravity/tree/interactions.hpp"
#include "gravity/tree/tree.hpp"

namespace breccia::gravity {

/// Results by sorted particle, in units of G mass/length^2 and G mass/length.
struct FieldSums {
  std::vector<double> acceleration[3];
  std::vector<double> potential;  ///< empty: not wanted
  std::vector<double> work;       ///< what each particle cost, in pairs of particles

  void reset(std::int64_t particles, bool with_potential);
};

/// How many interactions a walk took.
struct InteractionCounts {
  double pairs = 0.0;       ///< particle with particle
  double cells = 0.0;       ///< particle with cell
  double expansions = 0.0;  ///< cell with cell
  double missing = 0.0;     ///< cells that should have been opened but were not here; none in an essential tree

  InteractionCounts& operator+=(const InteractionCounts& b);
};

/// One walk. Lengths in Root::unit of both trees, which must share the root.
struct WalkSettings {
  double tolerance = 0.0;  ///< error allowed to one cell, as a fraction of the scale
  double softening = 0.0;
  int threads = 1;
};

/// Adds the field of `sources` to `sums` of the particles of `targets` (the same tree, or one of other particles).
/// Candidates that fail for a cell pass to its children, so each pair of cells meets once, at the largest targets it is
/// good for; groups take what is left as cells seen whole or as particles. The result does not depend on the threads.
template <class Real>
InteractionCounts walk(const Tree& targets, const std::vector<double>& scales, const Tree& sources,
                       const WalkSettings& settings, FieldSums& sums);

}  // namespace breccia::gravity

// A cell of the tree: what stands for its particles from afar, and where its parts are.
#pragma once

#include <cstdint>

#include "gravity/tree/multipole.hpp"

namespace breccia::gravity {

/// Most particles of a leaf (a source opened no further) and of a group (targets that share one interaction list).
inline constexpr std::int64_t kLeafParticles = 16;
inline constexpr std::int64_t kGroupParticles = 128;

/// A group that is wide against what pulls it, as debris is, is divided down to so many: each particle of a group sums
/// all that any of them needs. Measured: a tenth of the time in states b and f of gravity.md 3.
inline constexpr std::int64_t kSparseGroupParticles = 64;

inline constexpr std::int32_t kUnknownChildren = -1;

/// Lengths in Root::unit, masses in the caller's unit, G = 1. Children follow each other and come after their parent.
/// What the walk asks for fills one cache line.
struct alignas(64) Cell {
  std::int32_t first_child = 0;
  std::int32_t children = 0;        ///< kUnknownChildren: another rank knows them
  std::int32_t begin = 0, end = 0;  ///< particles in this rank's arrays
  std::int64_t count = 0;           ///< particles, those of all ranks
  double radius = 0.0;              ///< no particle is farther from the centre
  Vec3d centre{};                   ///< centre of mass
  Moments<double> moments{};        ///< about the centre
  std::int32_t key_bits = 0;        ///< leading key bits its particles share
  bool is_target = true;            ///< holds particles whose field this rank computes

  [[nodiscard]] BRECCIA_HD bool is_leaf() const { return children <= 0; }
  /// Has children or particles that this rank does not know.
  [[nodiscard]] BRECCIA_HD bool has_unknown_parts() const { return children < 0; }
  /// Targets below this cell share its interactions.
  [[nodiscard]] BRECCIA_HD bool is_group() const { return count <= kGroupParticles || is_leaf(); }
  /// Stays whole even in sparse matter.
  [[nodiscard]] BRECCIA_HD bool is_smallest_group() const { return count <= kSparseGroupParticles || is_leaf(); }
};

}  // namespace breccia::gravity

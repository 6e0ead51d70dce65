// How wrong the net force on a dense body is: pairs that a tree sums differently for either partner leave a body a
// force by itself (gravity.md 3, "Momentum").
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "breccia/linalg.hpp"

namespace breccia::gravity {

/// A body that would get a mesh.
struct DenseBody {
  std::uint64_t particles = 0;
  double mass_share = 0.0;  ///< of all mass
  double pull = 0.0;        ///< of the other dense bodies on it, over the mean gravity inside it
};

/// The same where it lies.
struct PlacedBody {
  std::uint64_t particles = 0;
  double mass = 0.0;    ///< [kg]
  double volume = 0.0;  ///< of its matter [m3]
  Vec3d centre{};       ///< [m]
};

/// Bodies as spheres of their volume that pull each other as points; `all_mass` with what is in none of them [kg].
std::vector<DenseBody> weigh(std::span<const PlacedBody> bodies, double all_mass);

/// What a body may be accelerated by mistake, in units of gravity.error times the pull of everything else on it: as
/// much as 99 % of single particles (gravity.md 7).
inline constexpr double kBodyTolerance = 3.7;

/// Pulls count at least this fraction of a body's own gravity. Weaker ones turn its path in no less than twice 1e5 s,
/// the length of a run, and what the tolerance then allows, 1.3e-5 of the own gravity at the default, would move the
/// body by less than a particle's spacing in that time if it always had the same direction; that of the tree is drawn
/// anew with the root at each evaluation.
inline constexpr double kLeastPull = 0.01;

/// Typical spurious acceleration of the body that has most of it, over the pull on that body, kLeastPull of its own
/// gravity at least. `opening`: that of the tree (tolerance.hpp). 0 without bodies.
double body_error_of_tree(std::span<const DenseBody> bodies, double opening);

/// The same where each body has a mesh.
double body_error_of_mesh(std::span<const DenseBody> bodies, double opening);

}  // namespace breccia::gravity

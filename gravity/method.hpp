// Which method is the cheapest that is accurate enough, from counts alone, so that ranks agree and runs repeat.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "breccia/scene.hpp"
#include "gravity/body_force.hpp"
#include "gravity/solver.hpp"

namespace breccia::gravity {

/// Matter of all ranks.
struct Matter {
  std::uint64_t particles = 0;
  std::uint64_t in_boxes = 0;       ///< of them, in boxes that would get a mesh
  double mesh_nodes = 0.0;          ///< of these boxes, not doubled
  std::vector<DenseBody> bodies{};  ///< what is in them, one for each
};

/// Below this error the float fields of the tree no longer follow the opening.
inline constexpr double kSmallestTreeError = 1e-6;

/// "off", "direct", "tree", "treepm" or "auto".
const char* name_of(GravityMethod method);

struct MethodChoice {
  GravityMethod method = GravityMethod::kDirect;
  std::string reason;
};

/// True up to some thousand particles, or where the error asked for is below what tree and mesh can do.
bool prefers_direct_sum(std::uint64_t particles, double error);

/// Whether the error asked for, and the smallest dense body, are what a mesh has been tested for.
bool mesh_is_accurate(const Matter& matter, double error);

/// True if the tree's net force on a dense body is off by more than kBodyTolerance allows and the mesh's by less.
bool tree_disturbs_more(const Matter& matter, const Parameters& parameters);
/// False if no dense body of `particles` particles, those of all ranks, could make that true.
bool tree_might_disturb(std::uint64_t particles, const Parameters& parameters);

/// The method kAuto stands for: the cheapest whose particles are right to Parameters::error and whose net force on each
/// dense body is to kBodyTolerance times that. Where dense bodies hold most particles the particle mesh is cheaper than
/// the tree; elsewhere it would pay twice, and is taken where the tree would disturb the bodies too much.
MethodChoice cheapest_method(const Matter& matter, const Parameters& parameters);

}  // namespace breccia::gravity

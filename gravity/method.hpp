// Which method is the cheapest that is accurate enough, from counts alone, so that ranks agree and runs repeat.
#pragma once

#include <cstdint>
#include <string>

#include "breccia/scene.hpp"

namespace breccia::gravity {

/// Matter of all ranks.
struct Matter {
  std::uint64_t particles = 0;
  std::uint64_t in_boxes = 0;  ///< of them, in boxes that would get a mesh
  double mesh_nodes = 0.0;     ///< of these boxes, not doubled
  int boxes = 0;
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

/// The method kAuto stands for. Where dense bodies hold most particles the particle mesh is cheaper than the tree, and
/// leaves bodies without debris a spurious acceleration hundreds of times smaller (gravity.md 3); elsewhere it would
/// pay twice.
MethodChoice cheapest_method(const Matter& matter, double error);

}  // namespace breccia::gravity

#include "gravity/method.hpp"

#include <fmt/format.h>

namespace breccia::gravity {
namespace {

// Below this the direct sum is faster on one core (measured; gravity.md 3), and exact.
constexpr std::uint64_t kDirectParticles = 2000;

// Of the mesh, errors down to about 4e-5 were tested.
constexpr double kSmallestMeshError = 3e-5;

// For the same error smaller bodies need a wider split (mesh/settings.cpp), which costs: at 32,000 particles the mesh
// takes 0.9 of the tree's time, at 16,000 1.15.
constexpr std::uint64_t kLeastMeshParticles = 30'000;

// Times relative to the tree's per particle, measured in states (a), (b), (c) of gravity.md 3 with 94,648 particles:
// pairs and sorting in a box, transforms, and the tree that is left where particles lie outside or boxes are several.
constexpr double kBoxedParticle = 0.4;
constexpr double kMeshNode = 0.05;
constexpr double kTreeOfAll = 0.2;
constexpr double kOutsideParticle = 1.0;

double mesh_over_tree(const Matter& matter) {
  const auto all = static_cast<double>(matter.particles);
  const auto boxed = static_cast<double>(matter.in_boxes);
  const bool needs_tree = matter.in_boxes < matter.particles || matter.boxes > 1;
  const double tree = needs_tree ? kTreeOfAll * all + kOutsideParticle * (all - boxed) : 0.0;
  return (kBoxedParticle * boxed + kMeshNode * matter.mesh_nodes + tree) / all;
}

}  // namespace

const char* name_of(GravityMethod method) {
  switch (method) {
    case GravityMethod::kOff:
      return "off";
    case GravityMethod::kDirect:
      return "direct";
    case GravityMethod::kTree:
      return "tree";
    case GravityMethod::kTreePm:
      return "treepm";
    case GravityMethod::kAuto:
      break;
  }
  return "auto";
}

bool prefers_direct_sum(std::uint64_t particles, double error) {
  return particles <= kDirectParticles || error < kSmallestTreeError;
}

MethodChoice cheapest_method(const Matter& matter, double error) {
  if (matter.particles <= kDirectParticles) {
    return {GravityMethod::kDirect, fmt::format("direct sum for up to {} particles", kDirectParticles)};
  }
  if (error < kSmallestTreeError) {
    return {GravityMethod::kDirect,
            fmt::format("direct sum, as gravity.error is below {:.0e}, the tree's best", kSmallestTreeError)};
  }
  if (matter.in_boxes == 0) return {GravityMethod::kTree, "tree, as there is no dense body to lay a mesh around"};
  if (error < kSmallestMeshError) {
    return {GravityMethod::kTree,
            fmt::format("tree, as gravity.error is below {:.0e}, the mesh's best", kSmallestMeshError)};
  }
  if (matter.in_boxes < kLeastMeshParticles * static_cast<std::uint64_t>(matter.boxes)) {
    return {GravityMethod::kTree, fmt::format("tree, as a mesh does not pay for dense bodies of less than {} particles",
                                              kLeastMeshParticles)};
  }
  const double cost = mesh_over_tree(matter);
  const double percent = 100.0 * static_cast<double>(matter.in_boxes) / static_cast<double>(matter.particles);
  const std::string why =
      fmt::format("{:.3g} % of the particles in dense bodies: a mesh costs {:.2g} of the tree", percent, cost);
  return cost < 1.0 ? MethodChoice{GravityMethod::kTreePm, "particle mesh, " + why}
                    : MethodChoice{GravityMethod::kTree, "tree, " + why};
}

}  // namespace breccia::gravity

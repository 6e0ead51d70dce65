#include "gravity/method.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "gravity/tree/tolerance.hpp"

namespace breccia::gravity {
namespace {

// Below this the direct sum is faster on one core (measured; gravity.md 3), and exact.
constexpr std::uint64_t kDirectParticles = 2000;

// Of the mesh, errors down to about 4e-5 were tested.
constexpr double kSmallestMeshError = 3e-5;

// For the same error smaller bodies need a wider split (mesh/settings.cpp), which costs: at 32,000 particles the mesh
// takes 0.9 of the tree's time, at 16,000 1.15.
constexpr std::uint64_t kLeastMeshParticles = 30'000;

// Of smaller ones even the widest split leaves more than the error asked for.
constexpr std::uint64_t kLeastAccurateBody = 8'000;

// Times relative to the tree's per particle, measured in states (a), (b), (c) of gravity.md 3 with 94,648 particles:
// pairs and sorting in a box, transforms, and the tree that is left where particles lie outside or boxes are several.
constexpr double kBoxedParticle = 0.4;
constexpr double kMeshNode = 0.05;
constexpr double kTreeOfAll = 0.2;
constexpr double kOutsideParticle = 1.0;

double mesh_over_tree(const Matter& matter) {
  const auto all = static_cast<double>(matter.particles);
  const auto boxed = static_cast<double>(matter.in_boxes);
  const bool needs_tree = matter.in_boxes < matter.particles || matter.bodies.size() > 1;
  const double tree = needs_tree ? kTreeOfAll * all + kOutsideParticle * (all - boxed) : 0.0;
  return (kBoxedParticle * boxed + kMeshNode * matter.mesh_nodes + tree) / all;
}

// Of tree and mesh, the one that costs less.
MethodChoice cheaper(const Matter& matter) {
  if (matter.in_boxes < kLeastMeshParticles * matter.bodies.size()) {
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

bool mesh_is_accurate(const Matter& matter, double error) {
  return error >= kSmallestMeshError &&
         std::all_of(matter.bodies.begin(), matter.bodies.end(),
                     [](const DenseBody& body) { return body.particles >= kLeastAccurateBody; });
}

bool tree_disturbs_more(const Matter& matter, const Parameters& parameters) {
  const double opening = opening_for(parameters, static_cast<double>(matter.particles));
  const double by_tree = body_error_of_tree(matter.bodies, opening);
  return by_tree > kBodyTolerance * parameters.error && body_error_of_mesh(matter.bodies, opening) < by_tree;
}

bool tree_might_disturb(std::uint64_t particles, const Parameters& parameters) {
  if (particles < kLeastAccurateBody) return false;
  const std::vector<DenseBody> smallest{{.particles = kLeastAccurateBody}};
  return body_error_of_tree(smallest, opening_for(parameters, static_cast<double>(particles))) >
         kBodyTolerance * parameters.error;
}

bool prefers_direct_sum(std::uint64_t particles, double error) {
  return particles <= kDirectParticles || error < kSmallestTreeError;
}

MethodChoice cheapest_method(const Matter& matter, const Parameters& parameters) {
  const double error = parameters.error;
  if (matter.particles <= kDirectParticles) {
    return {GravityMethod::kDirect, fmt::format("direct sum for up to {} particles", kDirectParticles)};
  }
  if (error < kSmallestTreeError) {
    return {GravityMethod::kDirect,
            fmt::format("direct sum, as gravity.error is below {:.0e}, the tree's best", kSmallestTreeError)};
  }
  if (matter.bodies.empty()) return {GravityMethod::kTree, "tree, as there is no dense body to lay a mesh around"};
  if (error < kSmallestMeshError) {
    return {GravityMethod::kTree,
            fmt::format("tree, as gravity.error is below {:.0e}, the mesh's best", kSmallestMeshError)};
  }
  MethodChoice choice = cheaper(matter);
  if (choice.method == GravityMethod::kTreePm || !mesh_is_accurate(matter, error)) return choice;
  if (!tree_disturbs_more(matter, parameters)) return choice;
  const double opening = opening_for(parameters, static_cast<double>(matter.particles));
  const double by_tree = body_error_of_tree(matter.bodies, opening);
  const double by_mesh = body_error_of_mesh(matter.bodies, opening);
  return {
      GravityMethod::kTreePm,
      fmt::format("particle mesh, though dearer: the tree's net force on a dense body would be off by {:.1e} of the "
                  "pull on it, the mesh's by {:.1e}; {:.1e} is allowed",
                  by_tree, by_mesh, kBodyTolerance * error)};
}

}  // namespace breccia::gravity

#include "cuda/gravity_choice.hpp"

#include <cmath>
#include <cstdio>

#include "gravity/tree/tolerance.hpp"

namespace breccia::cuda {
namespace {

using gravity::Matter;
using gravity::MethodChoice;
using gravity::Parameters;

// Pairs, and cells in their place, for each particle of a tree at the usual opening: 1860 in spheres and 1930 in debris
// of 12,000 particles, half as many again in larger trees; with an opening of 1.1e-5 1.7 and 1.9 times as many.
constexpr double kTreePairs = 2900.0;
constexpr double kUsualOpening = 1.2e-4;
constexpr double kOpeningPower = 0.26;

// Pairs for each particle in a box: those within the usual cutoff, and those of clusters that reach beyond.
constexpr double kNearPairs = 1000.0;

double tree_seconds(double bodies, double targets, double opening, const DeviceRates& rates) {
  const double pairs = kTreePairs * std::pow(kUsualOpening / opening, kOpeningPower);
  return rates.tree_seconds + bodies / rates.tree_bodies + targets * pairs / rates.tree_pairs;
}

std::string milliseconds(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g ms", 1e3 * seconds);
  return text;
}

// One body that has all particles: no other matter is cheaper for a mesh.
Matter one_body(std::uint64_t particles) {
  const auto n = static_cast<double>(particles);
  const double nodes = n / std::pow(gravity::kCellsPerSpacing, 3);
  return {.particles = particles,
          .in_boxes = particles,
          .mesh_nodes = nodes,
          .bodies = {{.particles = particles, .mass_share = 1.0}}};
}

}  // namespace

GravitySeconds gravity_seconds(const Matter& matter, const Parameters& parameters, const DeviceRates& rates,
                               int ranks) {
  const auto all = static_cast<double>(matter.particles);
  const auto boxed = static_cast<double>(matter.in_boxes);
  const double opening = gravity::opening_for(parameters, all);
  GravitySeconds seconds;
  seconds.direct = all * all / (ranks * rates.direct_pairs);
  seconds.tree = tree_seconds(all, all / ranks, opening, rates);
  const bool needs_tree = matter.in_boxes < matter.particles || matter.bodies.size() > 1;
  seconds.mesh = rates.lay_seconds + all / (ranks * rates.block_bodies) +
                 static_cast<double>(matter.bodies.size()) * rates.box_seconds + boxed / rates.tree_bodies +
                 boxed * kNearPairs / (ranks * rates.tree_pairs) + matter.mesh_nodes / (ranks * rates.mesh_nodes) +
                 (needs_tree ? tree_seconds(all, (all - boxed) / ranks, opening, rates) : 0.0);
  return seconds;
}

bool choice_needs_boxes(std::uint64_t particles, const Parameters& parameters, const DeviceRates& rates, int ranks) {
  const Matter best = one_body(particles);
  const GravitySeconds seconds = gravity_seconds(best, parameters, rates, ranks);
  if (seconds.direct <= seconds.tree || !gravity::mesh_is_accurate(best, parameters.error)) return false;
  return seconds.mesh < seconds.tree || gravity::tree_might_disturb(particles, parameters);
}

MethodChoice cheapest_on_device(const Matter& matter, const Parameters& parameters, const DeviceRates& rates,
                                int ranks) {
  const GravitySeconds seconds = gravity_seconds(matter, parameters, rates, ranks);
  if (parameters.error < gravity::kSmallestTreeError) {
    return {GravityMethod::kDirect, "direct sum, as gravity.error is below the tree's best"};
  }
  const std::string tree = milliseconds(seconds.tree);
  if (seconds.direct <= seconds.tree) {
    return {GravityMethod::kDirect,
            "direct sum: some " + milliseconds(seconds.direct) + " on the device, a tree " + tree};
  }
  if (matter.bodies.empty() || !gravity::mesh_is_accurate(matter, parameters.error)) {
    return {GravityMethod::kTree,
            "tree: some " + tree + " on the device, a direct sum " + milliseconds(seconds.direct)};
  }
  const std::string mesh = milliseconds(seconds.mesh);
  if (seconds.mesh < seconds.tree) {
    return {GravityMethod::kTreePm, "particle mesh: some " + mesh + " on the device, a tree " + tree};
  }
  if (gravity::tree_disturbs_more(matter, parameters)) {
    return {GravityMethod::kTreePm, "particle mesh, as a tree would pull dense bodies too much out of their ways"};
  }
  return {GravityMethod::kTree, "tree: some " + tree + " on the device, a particle mesh " + mesh};
}

}  // namespace breccia::cuda

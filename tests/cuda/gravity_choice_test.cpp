// What `auto` gravity takes on devices, by counts alone.
#include "cuda/gravity_choice.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace breccia::cuda {
namespace {

using gravity::DenseBody;
using gravity::Matter;

// A device that has a tenth of a second's pairs for every tree, so that the choice shows with few particles, and as
// much for a mesh as for a tree.
constexpr DeviceRates kRates{.direct_pairs = 1e9,
                             .tree_pairs = 1e9,
                             .tree_bodies = 1e8,
                             .mesh_nodes = 1e8,
                             .block_bodies = 1e8,
                             .lay_seconds = 0.0,
                             .tree_seconds = 0.1,
                             .box_seconds = 0.05};

// One dense body with the share `boxed` of all particles.
Matter matter(std::uint64_t particles, double boxed) {
  const auto in_boxes = static_cast<std::uint64_t>(boxed * static_cast<double>(particles));
  return {.particles = particles,
          .in_boxes = in_boxes,
          .mesh_nodes = 2.2 * static_cast<double>(in_boxes),
          .bodies = {{.particles = in_boxes, .mass_share = boxed}}};
}

GravityMethod method(const Matter& m, const gravity::Parameters& p = {}, int ranks = 1) {
  return cheapest_on_device(m, p, kRates, ranks).method;
}

// Pairs grow as the square of the particles; 0.1 s are 1e8 pairs.
TEST(GravityChoice, FewParticlesAreSummedDirectly) {
  EXPECT_EQ(method({.particles = 0}), GravityMethod::kDirect);
  EXPECT_EQ(method({.particles = 10'000}), GravityMethod::kDirect);
  EXPECT_EQ(method({.particles = 30'000}), GravityMethod::kTree);
}

// What ranks share shrinks, what each waits for does not.
TEST(GravityChoice, MoreDevicesSumMoreDirectly) {
  EXPECT_EQ(method({.particles = 12'000}), GravityMethod::kTree);
  EXPECT_EQ(method({.particles = 12'000}, {}, 4), GravityMethod::kDirect);
  const GravitySeconds one = gravity_seconds(matter(30'000, 1.0), {}, kRates, 1);
  const GravitySeconds four = gravity_seconds(matter(30'000, 1.0), {}, kRates, 4);
  EXPECT_DOUBLE_EQ(four.direct, 0.25 * one.direct);
  EXPECT_GT(four.tree, 0.25 * one.tree);
}

TEST(GravityChoice, MeshWhereDenseBodiesHoldMostParticles) {
  EXPECT_EQ(method(matter(100'000, 1.0)), GravityMethod::kTreePm);
  EXPECT_EQ(method(matter(100'000, 0.2)), GravityMethod::kTree);
}

// Errors beyond the mesh, then beyond float fields; bodies that are too small for the mesh.
TEST(GravityChoice, ErrorsDecideBeforeCosts) {
  EXPECT_EQ(method(matter(100'000, 1.0), {.error = 1e-5}), GravityMethod::kTree);
  EXPECT_EQ(method(matter(100'000, 1.0), {.error = 1e-8}), GravityMethod::kDirect);
  EXPECT_EQ(method({.particles = 100'000,
                    .in_boxes = 100'000,
                    .mesh_nodes = 2e5,
                    .bodies = {{.particles = 95'000, .mass_share = 0.95}, {.particles = 5'000, .mass_share = 0.05}}}),
            GravityMethod::kTree);
}

// A narrower opening means more cells to look at: where the tree takes longer, direct sums reach further.
TEST(GravityChoice, TreeTakesLongerWithNarrowOpenings) {
  const double wide = gravity_seconds({.particles = 100'000}, {.opening = 1.2e-4}, kRates, 1).tree;
  const double narrow = gravity_seconds({.particles = 100'000}, {.opening = 1.1e-5}, kRates, 1).tree;
  // Pairs are counted 1.7 to 1.9 times; waits and sorting stay.
  EXPECT_NEAR((narrow - 0.101) / (wide - 0.101), 1.8, 0.1);
}

// Where dense bodies could be disturbed by a tree, they must be looked for, and a mesh is taken though it is dearer.
TEST(GravityChoice, BodiesThatATreeDisturbsGetAMesh) {
  DeviceRates slow_mesh = kRates;
  slow_mesh.mesh_nodes = 1e4;
  const gravity::Parameters wide{.opening = 4e-3};
  Matter bodies = matter(100'000, 1.0);
  bodies.bodies = {2, DenseBody{.particles = 50'000, .mass_share = 0.5, .pull = 0.0}};
  EXPECT_TRUE(choice_needs_boxes(100'000, wide, slow_mesh, 1));
  EXPECT_EQ(cheapest_on_device(bodies, wide, slow_mesh, 1).method, GravityMethod::kTreePm);
  for (DenseBody& body : bodies.bodies) body.pull = 0.1;  // nobody notices
  EXPECT_EQ(cheapest_on_device(bodies, wide, slow_mesh, 1).method, GravityMethod::kTree);
}

// Boxes are laid only where that can change the choice, and then it is: no matter is cheaper for a mesh than one body.
TEST(GravityChoice, BoxesAreLaidOnlyWhereTheyCount) {
  DeviceRates slow_mesh = kRates;
  slow_mesh.lay_seconds = 1.0;
  EXPECT_TRUE(choice_needs_boxes(100'000, {}, kRates, 1));
  EXPECT_FALSE(choice_needs_boxes(10'000, {}, kRates, 1)) << "the direct sum is cheapest";
  EXPECT_FALSE(choice_needs_boxes(100'000, {.error = 1e-5}, kRates, 1)) << "beyond the mesh";
  EXPECT_FALSE(choice_needs_boxes(100'000, {}, slow_mesh, 1)) << "to choose them takes longer than the tree";
  for (const double boxed : {0.2, 0.6, 1.0}) {
    EXPECT_EQ(cheapest_on_device(matter(100'000, boxed), {}, slow_mesh, 1).method, GravityMethod::kTree) << boxed;
  }
}

// As the constants stand: a scene of the paper is summed directly, millions of particles are not, and one body of them
// gets a mesh.
TEST(GravityChoice, RatesOfADevice) {
  for (const auto& [rates, least] : {std::pair{kDeviceRates<float>, 20'000U}, {kDeviceRates<double>, 10'000U}}) {
    EXPECT_EQ(cheapest_on_device({.particles = least}, {}, rates, 1).method, GravityMethod::kDirect);
    EXPECT_EQ(cheapest_on_device({.particles = 1'000'000}, {}, rates, 1).method, GravityMethod::kTree);
    EXPECT_TRUE(choice_needs_boxes(1'000'000, {}, rates, 1));
    EXPECT_EQ(cheapest_on_device(matter(1'000'000, 1.0), {}, rates, 1).method, GravityMethod::kTreePm);
  }
}

}  // namespace
}  // namespace breccia::cuda

// What particles cost, as the balance of loads is told: counted, so the same wherever they are.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "deal_out.hpp"

namespace breccia::gravity {
namespace {

struct Counted {
  std::vector<double> work;  // of all particles in the order of the cloud
  Stats stats;
};

Counted count(GravityMethod method, const Cloud& cloud, const Owner& owner, int threads = 1) {
  const mpi::Comm comm;
  const auto solver = make_solver(
      method, {.softening = 125.0, .mesh = {.particle_spacing = 5.6e3, .cell = 7e3, .split = 0.8, .cutoff = 4.5}}, comm,
      threads);
  evaluate(*solver, cloud, owner);
  std::vector<double> all(cloud.position.size(), 0.0);
  std::size_t next = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (owner(i) == comm.rank()) all[i] = solver->work()[next++];
  }
  EXPECT_EQ(next, solver->work().size());
  comm.sum(std::span<double>(all));
  return {all, solver->last()};
}

double sum(const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0); }

Owner all_on_the_first() {
  return [](std::size_t) { return 0; };
}

TEST(Work, OfTheDirectSumIsThePairs) {
  const mpi::Comm comm;
  const Counted counted = count(GravityMethod::kDirect, two_spheres(500), round_robin());
  EXPECT_EQ(counted.work[7], 500.0);
  EXPECT_EQ(sum(counted.work), comm.sum(counted.stats.pairs));
}

TEST(Work, OfTheTreeIsItsInteractionsWhereverTheyAreSummed) {
  const mpi::Comm comm;
  const Cloud cloud = two_spheres(6000);
  const Counted even = count(GravityMethod::kTree, cloud, round_robin());
  const Counted one = count(GravityMethod::kTree, cloud, all_on_the_first(), 2);
  for (std::size_t i = 0; i < even.work.size(); ++i) ASSERT_NEAR(even.work[i] / one.work[i], 1.0, 1e-12);
  // A cell counts 2.2 pairs; an expansion 4.6, shared by all targets below it.
  const double expected =
      comm.sum(one.stats.pairs) + 2.2 * comm.sum(one.stats.cell_interactions) + 4.6 * comm.sum(one.stats.expansions);
  EXPECT_NEAR(sum(one.work) / expected, 1.0, 1e-9);
}

// Each particle meets at least all that lie within the cutoff, on whatever ranks they are, and itself. A list is made
// for sixteen targets at once, so there are more; the most where a rank has few particles to make clusters of.
TEST(Work, OfTheMeshIsThePairsOfTheNearField) {
  const Cloud cloud = two_spheres(6000);
  constexpr double kCell = 7e3;
  constexpr double kCutoff = 0.8 * 4.5 * kCell;
  std::vector<double> neighbours(cloud.position.size(), 0.0);
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    for (const Vec3d& x : cloud.position) {
      const Vec3d d = x - cloud.position[i];
      if (dot(d, d) < 0.999 * kCutoff * kCutoff) neighbours[i] += 1.0;
    }
  }
  for (const Owner& owner : {round_robin(), all_on_the_first()}) {
    const Counted counted = count(GravityMethod::kTreePm, cloud, owner, 2);
    ASSERT_EQ(counted.stats.boxes, 1);
    for (std::size_t i = 0; i < neighbours.size(); ++i) ASSERT_GE(counted.work[i], neighbours[i]);
    EXPECT_LT(sum(counted.work), 6.0 * sum(neighbours));
  }
}

}  // namespace
}  // namespace breccia::gravity

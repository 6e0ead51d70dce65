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
  const auto solver = make_solver(method, {.softening = 125.0, .error = 3.5e-4}, comm, threads);
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

TEST(Work, OfTheMeshIsThePairsOfTheNearField) {
  const mpi::Comm comm;
  const Cloud cloud = two_spheres(6000);
  const Counted even = count(GravityMethod::kTreePm, cloud, round_robin());
  const Counted one = count(GravityMethod::kTreePm, cloud, all_on_the_first(), 2);
  ASSERT_EQ(one.stats.boxes, 1);
  // Clusters are cut otherwise on other ranks, and those at the top of columns are part empty.
  EXPECT_NEAR(sum(even.work) / sum(one.work), 1.0, 0.3);
  EXPECT_LT(sum(one.work), comm.sum(one.stats.pairs));
  EXPECT_GT(sum(one.work), 0.7 * comm.sum(one.stats.pairs));
}

}  // namespace
}  // namespace breccia::gravity

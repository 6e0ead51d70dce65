// What a rank imports of other ranks' trees is all that its walks open (gravity.md 6.9), and no more than it must be.
#include <gtest/gtest.h>

#include <cmath>

#include "deal_out.hpp"
#include "gravity/tree/essential.hpp"

namespace breccia::gravity {
namespace {

// A rock of many particles and a quarter debris around it, in scaled coordinates.
Cloud rock_with_debris(std::size_t count) {
  Cloud cloud;
  std::mt19937_64 random(17);
  add_rock(cloud, count * 3 / 4, {}, 5e4, random);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  while (cloud.position.size() < count) {
    const Vec3d p{unit(random), unit(random), unit(random)};
    cloud.position.push_back(5e4 * std::pow(20.0, 0.5 * (1.0 + unit(random))) / std::sqrt(dot(p, p)) * p);
    cloud.mass.push_back(3e13);
  }
  return cloud;
}

struct Walked {
  InteractionCounts counts;
  EssentialCount imported;
  std::vector<double> x;  // acceleration along x by place in the cloud
};

Walked walked(const Cloud& cloud, const std::function<bool(std::size_t)>& is_mine, const mpi::Comm& comm,
              std::int64_t top_leaves) {
  Cloud mine;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < cloud.position.size(); ++i) {
    if (!is_mine(i)) continue;
    index.push_back(i);
    mine.position.push_back(cloud.position[i]);
    mine.mass.push_back(cloud.mass[i]);
  }
  constexpr double kTolerance = 2e-4;
  const Vec3d far{2e6, 2e6, 2e6};
  const Root root = random_root(-far, far);
  SharedTree tree(comm, 1, top_leaves);
  tree.build(root, {mine.position, mine.mass}, 3e13);
  tree.set_scales({}, 125.0 / root.unit, tree.largest_density());
  Walked result;
  const SharedTree* targets[1] = {&tree};
  result.imported = import_essential(tree, targets, kTolerance, comm);
  FieldSums sums;
  sums.reset(tree.tree().particles.size(), false);
  result.counts = walk<float>(tree.tree(), tree.scales(), tree.tree(), {kTolerance, 125.0 / root.unit, 1}, sums);
  result.x.assign(cloud.position.size(), 0.0);
  tree.deliver(sums,
               [&](std::size_t i, std::size_t k, const FieldSums& s) { result.x[index[i]] = s.acceleration[0][k]; });
  return result;
}

// With 200,000 particles and 1024 leaves of the top, many of these hold several groups: what these need is bounded.
// With more leaves each is a group, and what it needs is known.
TEST(EssentialTree, SufficesForEveryWalk) {
  const mpi::Comm comm;
  const Cloud cloud = rock_with_debris(200'000);
  const Walked alone = walked(
      cloud, [](std::size_t) { return true; }, mpi::Comm(MPI_COMM_SELF), SharedTree::kTopLeaves);
  const auto in_my_slab = [&](std::size_t i) {
    return (cloud.position[i].x > 0.0 ? comm.size() - 1 : 0) == comm.rank();
  };
  double imported_by_bound = 0.0;
  for (const std::int64_t top_leaves : {kCoarseCells, SharedTree::kTopLeaves}) {
    Walked is = walked(cloud, in_my_slab, comm, top_leaves);
    SCOPED_TRACE(std::to_string(top_leaves) + " leaves");
    EXPECT_EQ(is.counts.missing, 0.0);
    EXPECT_EQ(comm.sum(is.counts.pairs), alone.counts.pairs);
    EXPECT_EQ(comm.sum(is.counts.cells), alone.counts.cells);
    comm.sum(std::span<double>(is.x));
    double worst = 0.0;
    for (std::size_t i = 0; i < is.x.size(); ++i) {
      worst = std::max(worst, std::abs(is.x[i] - alone.x[i]) / (1e-3 + std::abs(alone.x[i])));
    }
    // The same interactions in another order, in float.
    EXPECT_LT(worst, 1e-3);
    if (comm.size() == 1) continue;
    // A layer has 3 % of the body; groups four spacings wide sum neighbours up to about seven away.
    const double imported = is.imported.cells + is.imported.particles;
    EXPECT_GT(imported, 0.0);
    EXPECT_LT(imported, 0.5 * 100'000);
    if (top_leaves == kCoarseCells) imported_by_bound = imported;
    EXPECT_LE(imported, imported_by_bound);
  }
}

}  // namespace
}  // namespace breccia::gravity

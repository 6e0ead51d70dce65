// The same run on any number of ranks: compared, particle by particle, with one rank (physics.md 8, case 17).
#include <gtest/gtest.h>

#include "tests/sim/collision.hpp"
#include "tests/sim/states.hpp"

namespace breccia::sim::test {
namespace {

Work expect_same_as_one_rank(const Scene& scene, const Scale& scale) {
  const std::vector<State> many = history(scene, mpi::Comm());
  const std::vector<State> one = history(scene, mpi::Comm(MPI_COMM_SELF));
  for (std::size_t n = 0; n < one.size(); ++n) expect_equal(many.at(n), one[n], scale);
  return work_of(many);
}

int ranks() { return mpi::Comm().size(); }

TEST(Ranks, CollisionWithEveryEffect) {
  const Work work = expect_same_as_one_rank(load(collision(9e3)), {200e3, 200.0});
  EXPECT_EQ(work.busy_ranks, ranks());
  EXPECT_TRUE(work.was_breaking);
  // Two ranks have the plane of contact between them, which nothing has to cross.
  EXPECT_TRUE(ranks() <= 2 || work.migrated > 50) << work.migrated;
}

// Two spheres of four cells are some ten planes of nodes: slabs are as thin as a particle's reach, two planes, or
// thinner.
TEST(Ranks, SlabsThinnerThanTheReach) {
  const Work work = expect_same_as_one_rank(load(collision(25e3)), {200e3, 200.0});
  EXPECT_EQ(work.busy_ranks, ranks());
}

// They are three or four planes of blocks, which reproducible runs keep whole: some of five ranks own nothing.
TEST(Ranks, FewerSlabsThanRanks) {
  const Work work = expect_same_as_one_rank(
      load(collision(25e3), {"numerics.reproducible=true", "effects.gravity=off"}), {200e3, 200.0});
  EXPECT_LT(work.busy_ranks, 5);
  EXPECT_GE(work.busy_ranks, std::min(2, ranks()));
}

TEST(Ranks, OneParticleEach) {
  const Work work =
      expect_same_as_one_rank(load(collision(9e3), {"body[0].particles=1", "body[1].particles=1"}), {200e3, 200.0});
  EXPECT_EQ(work.busy_ranks, std::min(2, ranks()));
}

TEST(Ranks, BodyThatLeavesItsSlabs) {
  const Scene scene = load(flying_body("8 km"), {"effects.gravity=direct", "numerics.precision=double"});
  const Work work = expect_same_as_one_rank(scene, {36e3, 2000.0});
  EXPECT_TRUE(ranks() == 1 || work.migrated > 100) << work.migrated;
}

// Along a periodic axis the first and the last slab are neighbours; one block is its own neighbour on both sides, two
// are neighbours twice, an odd number needs a third colour. Along z tiles are stacks of four blocks: a part of one, and
// one and a part of the next. All are cut across that axis, one block through itself.
class PeriodicRanks : public testing::TestWithParam<std::pair<int, int>> {};
TEST_P(PeriodicRanks, SlideThroughTheEnds) {
  const auto [axis, blocks] = GetParam();
  const double length = 4e3 * blocks;
  const std::string across = std::string("parallel.axis=") + "xyz"[axis];
  const Work work =
      expect_same_as_one_rank(load(periodic_slide(blocks, axis), {across}), {length, 150.0, length, axis});
  EXPECT_GE(work.busy_ranks, std::min(ranks(), 4 * blocks));
  EXPECT_TRUE(ranks() == 1 || work.migrated > 50) << work.migrated;
}
INSTANTIATE_TEST_SUITE_P(AxisAndBlocks, PeriodicRanks,
                         testing::Values(std::pair(0, 1), std::pair(0, 2), std::pair(0, 3), std::pair(2, 1),
                                         std::pair(2, 2), std::pair(2, 3), std::pair(2, 5)));

// Messages that travel behind the interior tiles carry the same values as those that are waited for at once: what is
// added to shared nodes, and in which order, does not depend on when it arrives. Bodies on a wall, so that nodes of the
// wall are shared, too.
TEST(Overlap, SameBitsAsWithout) {
  const std::string wall = R"([[boundary]]
point = ["0 km", "0 km", "-50 km"]
normal = [0, 0, 1]
kind = "friction"
friction = 0.3
)";
  // Tiles enough that ranks look at the messages between them.
  const Scene scene = load(collision(6e3) + wall, {"effects.gravity=off", "numerics.precision=mixed"});
  const auto state = [&](bool overlap) {
    Scene with = scene;
    with.numerics.overlap = overlap;
    const mpi::Comm comm;
    return gather(state_after(16, with, comm), comm);
  };
  expect_equal(state(true), state(false), {1.0, 1.0}, 0.0);
}

}  // namespace
}  // namespace breccia::sim::test

// Slabs that are cut anew while the run goes on: the same physics, repeatable, and the work even.
#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

#include "tests/sim/collision.hpp"
#include "tests/sim/states.hpp"

namespace breccia::sim::test {
namespace {

int ranks() { return mpi::Comm().size(); }

// 5 planes of blocks further in the end.
std::string long_flying_body() {
  return flying_body("16 km") + R"([effects]
gravity = "direct"
[gravity]
interval = 8
[numerics]
precision = "double"
)";
}

struct Outcome {
  std::vector<State> states;
  BalanceState balance;
};

Outcome run(const std::string& text, std::vector<std::string> overrides) {
  Outcome outcome;
  outcome.states =
      history(load(text, overrides), mpi::Comm(), [&](const TimeLoop& loop) { outcome.balance = loop.balance(); });
  return outcome;
}

// Sums of a node run in another order where slabs differ: ranks_test.cpp has the same bound, and its reason.
void expect_same_physics(const std::string& text, const Scale& scale,
                         const std::string& window = "gravity.interval=8") {
  const Outcome off = run(text, {window, "parallel.balance=off"});
  EXPECT_EQ(off.balance.recuts, 0U);
  for (const char* how : {"auto", "always"}) {
    const Outcome other = run(text, {window, std::string("parallel.balance=") + how, "parallel.imbalance=1.01"});
    ASSERT_EQ(other.states.size(), off.states.size());
    for (std::size_t n = 0; n < off.states.size(); ++n) expect_equal(other.states[n], off.states[n], scale);
    EXPECT_TRUE(std::strcmp(how, "auto") == 0 || other.balance.recuts == other.balance.windows);
  }
}

TEST(Balance, SamePhysicsInACollision) { expect_same_physics(collision(9e3), {200e3, 200.0}); }
// Cuts move where windows begin: with windows of one step, in every step.
TEST(Balance, SamePhysicsCutAnewInEveryStep) {
  expect_same_physics(long_flying_body(), {52e3, 2000.0}, "gravity.interval=1");
}
TEST(Balance, SamePhysicsOfAFlyingBody) { expect_same_physics(long_flying_body(), {52e3, 2000.0}); }

TEST(Balance, RepeatsBitForBit) {
  const std::vector<std::string> overrides{"parallel.imbalance=1.01", "numerics.precision=mixed"};
  const Outcome one = run(long_flying_body(), overrides);
  const Outcome two = run(long_flying_body(), overrides);
  EXPECT_EQ(one.balance.recuts, two.balance.recuts);
  EXPECT_EQ(one.balance.imbalance_sum, two.balance.imbalance_sum);
  for (std::size_t n = 0; n < one.states.size(); ++n) {
    expect_equal(one.states[n], two.states[n], {1.0, 1.0}, 0.0);
  }
}

// Left alone, the slab in front gets everything. Nine planes of blocks at most: two ranks come as near as half a plane.
TEST(Balance, WorkStaysEvenWhereMatterMoves) {
  if (ranks() == 1) return;
  const BalanceState off = run(long_flying_body(), {"parallel.balance=off"}).balance;
  const BalanceState on = run(long_flying_body(), {}).balance;
  EXPECT_GT(off.imbalance, 1.5);
  EXPECT_GE(on.recuts, 2U);
  EXPECT_LT(on.imbalance_sum / static_cast<double>(on.windows), ranks() == 2 ? 1.15 : 1.4);
  EXPECT_GE(on.imbalance_max, on.imbalance);
}

// Counts do not depend on where a particle is: all ranks together count the same, however the grid is cut, but for the
// tiles of a plane of blocks that a cut divides. Particles without grid are left out: one at a cut has neighbours that
// its rank does not know.
void expect_counts_of_one_rank(const std::string& axis, bool reproducible) {
  const Scene scene =
      load(collision(9e3), {"numerics.lone_without_grid=false", "parallel.axis=" + axis,
                            reproducible ? "numerics.reproducible=true" : "numerics.reproducible=false"});
  const ResolvedEffects effects = resolve_effects(scene);
  const TimeLoop many(scene, effects, 1, mpi::Comm());
  const TimeLoop one(scene, effects, 1, mpi::Comm(MPI_COMM_SELF));
  const auto count = [](const TimeLoop& loop, const mpi::Comm& comm, double more) {
    const std::vector<double> each(more > 0.0 ? loop.engine().stats().particles : 0, more);
    return mpi::sum_over_ranks(loop.engine().work(each), comm);
  };
  const mpi::PlaneWork all = count(one, mpi::Comm(MPI_COMM_SELF), 0.0);
  const mpi::PlaneWork of_many = count(many, mpi::Comm(), 0.0);
  EXPECT_EQ(of_many.nodes, all.nodes);
  const std::vector<std::int32_t>& cuts = many.engine().slabs().cuts();
  for (const auto& [block, work] : all.blocks) {
    const bool divided = std::ranges::any_of(
        cuts, [&](std::int32_t c) { return mpi::block_of_plane(c) == block && c % mpi::kPlanesOfBlock != 0; });
    EXPECT_TRUE(divided || of_many.blocks.at(block) == work) << block;
  }
  // Tiles are one block wide but along z, where they are stacks of four.
  const std::int32_t tile = (axis == "z" ? 4 : 1) * mpi::kPlanesOfBlock;
  EXPECT_TRUE(!reproducible || many.engine().slabs().keep_whole(tile));
  // What a particle costs elsewhere is added where it is.
  const mpi::PlaneWork with_gravity = count(one, mpi::Comm(MPI_COMM_SELF), 1000.0);
  EXPECT_EQ(count(many, mpi::Comm(), 1000.0).nodes, with_gravity.nodes);
  EXPECT_EQ(mpi::total(with_gravity) - mpi::total(all), 1000 * one.engine().stats().particles);
}
TEST(Balance, CountsAreThoseOfOneRank) {
  expect_counts_of_one_rank("x", false);
  expect_counts_of_one_rank("x", true);
  expect_counts_of_one_rank("z", true);
}

TEST(Balance, AxisIsTheLongestOrTheOneAskedFor) {
  const auto axis_of = [](const std::vector<std::string>& overrides) {
    const Scene scene = load(long_flying_body(), overrides);
    return TimeLoop(scene, resolve_effects(scene), 1, mpi::Comm()).engine().slabs().axis();
  };
  EXPECT_EQ(axis_of({}), 0);
  EXPECT_EQ(axis_of({R"(body[0].axes=["3 km", "3 km", "16 km"])"}), 2);
  EXPECT_EQ(axis_of({"parallel.axis=y"}), 1);
}

}  // namespace
}  // namespace breccia::sim::test

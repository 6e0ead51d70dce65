// The same run on any number of ranks: compared, particle by particle, with one rank (physics.md 8, case 17).
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/sim/collision.hpp"

namespace breccia::sim::test {
namespace {

// What is compared of a particle, and where it was.
struct Sample {
  std::uint64_t id;
  Vec3d position, velocity;
  double damage, density, pressure, energy;
  int rank;
};
using State = std::vector<Sample>;  // all particles of all ranks in the order of their ids

State gather(const ParticleOutput& p, const mpi::Comm& comm) {
  State mine;
  for (std::size_t i = 0; i < p.size(); ++i) {
    mine.push_back({p.id[i], p.position[i], p.velocity[i], p.damage[i], p.density[i], p.pressure[i],
                    p.internal_energy[i], comm.rank()});
  }
  State all = comm.allgather_arrays(std::span<const Sample>(mine));
  std::sort(all.begin(), all.end(), [](const Sample& a, const Sample& b) { return a.id < b.id; });
  return all;
}

std::vector<State> history(const Scene& scene, const mpi::Comm& comm) {
  constexpr std::uint64_t kSteps = 200, kEvery = 20;
  std::vector<State> states;
  simulate(
      scene,
      [&](const TimeLoop& loop) {
        if (loop.step() % kEvery == 0) states.push_back(gather(loop.engine().observe(), comm));
        return loop.step() < kSteps;
      },
      comm);
  return states;
}

double length(Vec3d v) { return std::sqrt(dot(v, v)); }

// Lengths and speeds of a scene.
struct Scale {
  double size;          // [m]
  double speed;         // [m/s]
  double period = 0.0;  // of a periodic x axis [m]
};

// The sums of a node are the same but for their order where slabs meet: 1e-16 of the values per step. 200 steps with
// contact and yielding may amplify that a little, to 1e-12 of the scene's scales; a message that is lost, doubled or
// late shows as 1e-6 and more.
void expect_equal(const State& many, const State& one, const Scale& scale) {
  constexpr double kTolerance = 1e-12;
  constexpr double kBulkModulus = 2.67e10, kDensity = 2700.0;
  ASSERT_EQ(many.size(), one.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    ASSERT_EQ(many[i].id, one[i].id);
    Vec3d moved = many[i].position - one[i].position;
    if (scale.period > 0.0) moved.x -= scale.period * std::round(moved.x / scale.period);
    ASSERT_LE(length(moved), kTolerance * scale.size) << "particle " << i;
    ASSERT_LE(length(many[i].velocity - one[i].velocity), kTolerance * scale.speed) << "particle " << i;
    ASSERT_NEAR(many[i].damage, one[i].damage, kTolerance) << "particle " << i;
    ASSERT_NEAR(many[i].density, one[i].density, kTolerance * kDensity) << "particle " << i;
    ASSERT_NEAR(many[i].pressure, one[i].pressure, kTolerance * kBulkModulus) << "particle " << i;
    ASSERT_NEAR(many[i].energy, one[i].energy, kTolerance * scale.speed * scale.speed) << "particle " << i;
  }
}

// What the ranks had to do in a run: no case may pass for want of work.
struct Work {
  int busy_ranks = 0;         // that held particles at the start
  std::size_t migrated = 0;   // times that a particle was on another rank than in the state before
  bool was_breaking = false;  // some state had a damaged fraction between 5 and 95 %
};

Work work_of(const std::vector<State>& states) {
  Work work;
  std::set<int> ranks;
  for (const Sample& s : states.front()) ranks.insert(s.rank);
  work.busy_ranks = static_cast<int>(ranks.size());
  for (std::size_t n = 1; n < states.size(); ++n) {
    for (std::size_t i = 0; i < states[n].size(); ++i) {
      if (states[n][i].rank != states[n - 1][i].rank) ++work.migrated;
    }
  }
  for (const State& state : states) {
    double damage = 0.0;
    for (const Sample& s : state) damage += s.damage / static_cast<double>(state.size());
    work.was_breaking = work.was_breaking || (damage > 0.05 && damage < 0.95);
  }
  return work;
}

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

// Two spheres of four cells are three or four planes of blocks: some of five ranks own nothing.
TEST(Ranks, FewerSlabsThanRanks) {
  const Work work = expect_same_as_one_rank(load(collision(25e3)), {200e3, 200.0});
  EXPECT_LT(work.busy_ranks, 5);
  EXPECT_GE(work.busy_ranks, std::min(2, ranks()));
}

TEST(Ranks, OneParticleEach) {
  const Work work =
      expect_same_as_one_rank(load(collision(9e3), {"body[0].particles=1", "body[1].particles=1"}), {200e3, 200.0});
  EXPECT_EQ(work.busy_ranks, std::min(2, ranks()));
}

// A spinning body that flies 20 cells, out of all slabs that were cut for it at the start.
TEST(Ranks, BodyThatLeavesItsSlabs) {
  const Scene scene = load(R"([scene]
end = "1000 s"
[grid]
cell = "1 km"
[time]
step = "0.05 s"
[[body]]
shape = "ellipsoid"
axes = ["8 km", "3 km", "3 km"]
velocity = ["2 km/s", 0, 0]
spin = [0, "0.01 rad/s", "0.02 rad/s"]
[effects]
gravity = "direct"
[numerics]
precision = "double"
)");
  const Work work = expect_same_as_one_rank(scene, {36e3, 2000.0});
  EXPECT_TRUE(ranks() == 1 || work.migrated > 100) << work.migrated;
}

// Along a periodic axis the first and the last slab are neighbours; one block is its own neighbour on both sides, two
// are neighbours twice, an odd number needs a third colour.
class PeriodicRanks : public testing::TestWithParam<int> {};
TEST_P(PeriodicRanks, SlideThroughTheEnds) {
  const double length = 4e3 * GetParam();
  const Work work = expect_same_as_one_rank(load(periodic_slide(GetParam())), {length, 150.0, length});
  // One block alone is cut along another axis.
  EXPECT_TRUE(ranks() == 1 || GetParam() == 1 || work.migrated > 50) << work.migrated;
}
INSTANTIATE_TEST_SUITE_P(Blocks, PeriodicRanks, testing::Values(1, 2, 3, 4));

}  // namespace
}  // namespace breccia::sim::test

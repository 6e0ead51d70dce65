// numerics.reproducible: the same bits on any number of ranks and threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numeric>

#include "io/checkpoint.hpp"
#include "tests/sim/collision.hpp"

namespace breccia::sim::test {
namespace {

// Everything that a snapshot holds of the particles, in the order of their ids.
struct State {
  std::vector<double> numbers;
  std::uint64_t particles = 0;
  std::uint64_t lone = 0;
  bool operator==(const State& other) const {
    return numbers.size() == other.numbers.size() &&
           std::memcmp(numbers.data(), other.numbers.data(), numbers.size() * sizeof(double)) == 0;
  }
};

State state_of(const grid::Engine& engine, const mpi::Comm& comm) {
  constexpr std::size_t kColumns = 14;
  struct Row {
    std::uint64_t id;
    double value[kColumns];
  };
  const ParticleOutput p = engine.observe();
  const auto or_zero = [](const std::vector<double>& values, std::size_t i) {
    return values.empty() ? 0.0 : values[i];
  };
  std::vector<Row> mine;
  for (std::size_t i = 0; i < p.size(); ++i) {
    mine.push_back(
        {p.id[i],
         {p.position[i].x, p.position[i].y, p.position[i].z, p.velocity[i].x, p.velocity[i].y, p.velocity[i].z,
          p.mass[i], p.damage[i], p.density[i], p.grid_density[i], or_zero(p.internal_energy, i), p.pressure[i],
          or_zero(p.shear_stress, i), static_cast<double>(p.body[i])}});
  }
  std::vector<Row> all = comm.allgather_arrays(std::span<const Row>(mine));
  std::ranges::sort(all, {}, &Row::id);
  State state;
  state.particles = all.size();
  state.lone = comm.sum(engine.stats().lone_particles);
  for (const Row& row : all) state.numbers.insert(state.numbers.end(), row.value, row.value + kColumns);
  return state;
}

struct Plan {
  std::uint64_t steps = 80, every = 40;
};

std::vector<State> history(const Scene& scene, const mpi::Comm& comm, int threads, const Plan& plan) {
  std::vector<State> states;
  simulate(
      scene,
      [&](const TimeLoop& loop) {
        if (loop.step() % plan.every == 0) states.push_back(state_of(loop.engine(), comm));
        return loop.step() < plan.steps;
      },
      comm, threads);
  return states;
}

// Returns the states on one rank.
std::vector<State> expect_same(const std::string& text, std::vector<std::string> keys, const Plan& plan = {}) {
  keys.emplace_back("numerics.reproducible=true");
  const Scene scene = load(text, keys);
  std::vector<State> one = history(scene, mpi::Comm(MPI_COMM_SELF), 1, plan);
  for (const int threads : {1, 3}) {
    if (threads > 1 && mpi::Comm().size() > 2) break;  // too many for two cores
    EXPECT_TRUE(history(scene, mpi::Comm(), threads, plan) == one) << threads << " threads";
  }
  return one;
}

const std::string kNoGravity = "effects.gravity=off";

class Reproducible : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] std::vector<std::string> keys() const {
    return {std::string("numerics.precision=") + GetParam(), kNoGravity};
  }
};

TEST_P(Reproducible, CollisionWithEveryEffect) {
  const std::vector<State> states = expect_same(collision(12e3), keys());
  EXPECT_GT(states.back().particles, 500U);
}

// Slabs along y, and along z, in which every plane of tiles has a boundary: there four stacks of blocks.
TEST_P(Reproducible, CutAcrossThePlanesOfTiles) {
  for (const char* velocity :
       {R"(body[0].velocity=[0, "400 m/s", "30 m/s"])", R"(body[0].velocity=["50 m/s", 0, 0])"}) {
    const bool along_y = std::strchr(velocity, '4') != nullptr;
    std::vector<std::string> all = keys();
    all.emplace_back(velocity);
    all.emplace_back(along_y ? R"(body[0].axes=["8 km", "20 km", "9 km"])"
                             : R"(body[0].axes=["8 km", "9 km", "45 km"])");
    expect_same(scene_of(2.5e3, 0.1) + R"([[body]]
shape = "ellipsoid"
axes = ["20 km", "8 km", "9 km"]
spin = ["0.002 rad/s", "0.001 rad/s", 0]
)",
                all);
  }
}

TEST_P(Reproducible, DebrisThatNeedsNoGrid) {
  const std::vector<State> states = expect_same(debris(), keys(), {160, 20});
  // No case may pass for want of work.
  EXPECT_GT(states.front().lone, 20U);
  EXPECT_LT(states.front().lone, 290U);
}

TEST_P(Reproducible, BodyThatLeavesItsSlabs) { expect_same(flying_body("8 km"), keys(), {160, 80}); }

TEST_P(Reproducible, SlidingThroughAPeriodicAxis) {
  for (const int blocks : {1, 2, 3}) expect_same(periodic_slide(blocks), keys(), {40, 20});
  // Along z nodes have images beyond the period: slabs that cut them, and slabs across.
  std::vector<std::string> along_x = keys();
  along_x.emplace_back("parallel.axis=x");
  for (const int blocks : {1, 5}) {
    expect_same(periodic_slide(blocks, 2), keys(), {40, 20});
    expect_same(periodic_slide(blocks, 2), along_x, {40, 20});
  }
}

INSTANTIATE_TEST_SUITE_P(Precisions, Reproducible, testing::Values("mixed", "double"));

// The checkpoint of many ranks goes on on one, and is the run of one rank from the start.
TEST(ReproducibleRestart, OnAnotherNumberOfRanks) {
  constexpr std::uint64_t kCheckpoint = 32, kEnd = 100;
  const Scene scene = load(collision(12e3), {kNoGravity, "numerics.precision=mixed", "numerics.reproducible=true"});
  const mpi::Comm world;
  const mpi::Comm self(MPI_COMM_SELF);
  const auto pid = world.allgather(static_cast<std::int64_t>(getpid()))[0];
  const auto file = std::filesystem::temp_directory_path() / ("breccia_reproducible_" + std::to_string(pid) + ".h5");
  LoopState at_checkpoint;
  {
    TimeLoop loop(scene, resolve_effects(scene), 1, world);
    loop.run([](const TimeLoop&) { return true; },
             [&](const TimeLoop& now) {
               if (now.step() < kCheckpoint) return true;
               at_checkpoint = now.state();
               io::write_checkpoint(file, {now.engine().save(), "{}"}, world);
               return false;
             });
  }
  State continued;
  TimeLoop loop(scene, resolve_effects(scene), io::read_checkpoint(file, self).engine, at_checkpoint, 1, self);
  loop.run([&](const TimeLoop& now) {
    if (now.step() < kEnd) return true;
    continued = state_of(now.engine(), self);
    return false;
  });
  EXPECT_TRUE(history(scene, self, 1, {kEnd, kEnd}).back() == continued);
  world.barrier();
  if (world.is_root()) std::filesystem::remove(file);
}

// With self-gravity, sums over all particles depend on the ranks: to rounding where pairs are summed in double, to the
// errors of the method else (moments of cells that other groups open).
class ReproducibleGravity : public testing::TestWithParam<std::pair<const char*, double>> {};
TEST_P(ReproducibleGravity, DiffersByItsOwnErrorOnly) {
  const auto [method, tolerance] = GetParam();
  const Scene scene = load(collision(10e3), {std::string("effects.gravity=") + method, "numerics.reproducible=true"});
  const Plan plan{32, 32};
  const State one = history(scene, mpi::Comm(MPI_COMM_SELF), 1, plan).back();
  const State many = history(scene, mpi::Comm(), 1, plan).back();
  EXPECT_TRUE(history(scene, mpi::Comm(), 1, plan).back() == many);
  // Of what gravity has changed until then: 0.04 m/s2 at the surface of a body.
  const double gained = 0.04 * static_cast<double>(plan.steps) * 10e3 / 2500.0 * 0.1220703125;
  double squares = 0.0;
  for (std::size_t i = 0; i < one.particles; ++i) {
    for (std::size_t axis = 3; axis < 6; ++axis) {
      squares += std::pow(many.numbers[14 * i + axis] - one.numbers[14 * i + axis], 2.0);
    }
  }
  EXPECT_LE(std::sqrt(squares / static_cast<double>(one.particles)), tolerance * gained);
}
INSTANTIATE_TEST_SUITE_P(Methods, ReproducibleGravity,
                         testing::Values(std::pair{"direct", 1e-12}, std::pair{"tree", 2e-5},
                                         std::pair{"treepm", 2e-5}));

}  // namespace
}  // namespace breccia::sim::test

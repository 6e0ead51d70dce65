// Numbers that go wrong end the run on all ranks at once, with the particle (physics.md 8, cases 3 and 29). A
// checkpoint is where a test can reach into a particle: it is taken, changed and continued.
#include "sim/guard.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "breccia/error.hpp"
#include "sim/suspects.hpp"
#include "tests/sim/collision.hpp"

namespace breccia::sim::test {
namespace {

constexpr std::uint64_t kWindow = 8;

struct Saved {
  EngineState engine;
  LoopState loop;
};

Scene scene_with(std::vector<std::string> overrides) {
  overrides.emplace_back("gravity.interval=8");
  return load(collision(9e3), overrides);
}

// Bodies so thin that particles are alone; the step is stable for contacts of cells this small.
Scene thin_scene(std::vector<std::string> overrides) {
  overrides.insert(overrides.end(),
                   {"grid.cell=1500 m", "time.step=0.0732421875 s", "body[0].particles=300", "body[1].particles=300"});
  return scene_with(std::move(overrides));
}

// The state at the end of the first window.
Saved saved_state(const Scene& scene, const mpi::Comm& comm) {
  Saved saved;
  TimeLoop loop(scene, resolve_effects(scene), 1, comm);
  loop.run([](const TimeLoop&) { return true; },
           [&](const TimeLoop& now) {
             saved = {now.engine().save(), now.state()};
             return false;
           });
  return saved;
}

StateColumn& column(EngineState& state, const std::string& name) {
  return *std::ranges::find_if(state.columns, [&](const StateColumn& c) { return c.name == name; });
}

// Sets one component of a particle of this rank.
void set(EngineState& state, const std::string& name, std::size_t component, double value, std::size_t particle = 0) {
  StateColumn& c = column(state, name);
  std::byte* const to = c.values.data() + (particle * c.components + component) * c.element_bytes;
  const auto single = static_cast<float>(value);
  if (c.element_bytes == 4) {
    std::memcpy(to, &single, 4);
  } else {
    std::memcpy(to, &value, 8);
  }
}

std::uint64_t id_of(EngineState& state, std::uint64_t particle) {
  std::uint32_t id = 0;
  std::memcpy(&id, column(state, "id_low").values.data() + particle * sizeof id, sizeof id);
  return id;
}
std::uint64_t first_id(EngineState& state) { return id_of(state, 0); }
std::uint64_t last_id(EngineState& state) { return id_of(state, state.particles - 1); }

struct Ending {
  std::string error;  // empty: the run came through
  std::uint64_t steps = 0;
  std::optional<GuardedFault> fault;
  LostWork lost;
};

Ending continued(const Scene& scene, const Saved& saved, const mpi::Comm& comm) {
  constexpr std::uint64_t kSteps = 5 * kWindow;
  TimeLoop loop(scene, resolve_effects(scene), saved.engine, saved.loop, 1, comm);
  Ending ending;
  try {
    loop.run([&](const TimeLoop& now) { return now.step() < kSteps; });
  } catch (const NumericsError& error) {
    ending.error = error.what();
  }
  ending.steps = loop.step();
  ending.fault = loop.guard().fault();
  ending.lost = loop.lost_work();
  return ending;
}

// Changes a particle of the last rank alone; what comes of it must be the same everywhere.
Ending ending_with(const Scene& scene, const std::function<void(EngineState&)>& change, const mpi::Comm& comm) {
  Saved saved = saved_state(scene, comm);
  if (comm.rank() == comm.size() - 1) change(saved.engine);
  Ending ending = continued(scene, saved, comm);
  const std::vector<char> all = comm.allgather_arrays(std::span<const char>(ending.error));
  EXPECT_EQ(all.size(), ending.error.size() * static_cast<std::size_t>(comm.size()));
  return ending;
}

// The id of the particle that ending_with() changes, on all ranks.
std::uint64_t changed_id(const Scene& scene, const mpi::Comm& comm, std::uint64_t (*which)(EngineState&) = first_id) {
  Saved saved = saved_state(scene, comm);
  return comm.allgather(which(saved.engine)).back();
}

class NotFinite : public testing::TestWithParam<std::tuple<const char*, const char*, double>> {};

TEST_P(NotFinite, EndsTheRunWithTheParticle) {
  const auto& [precision, field, value] = GetParam();
  const mpi::Comm comm;
  const Scene scene = scene_with({std::string("numerics.precision=") + precision});
  const Ending ending = ending_with(
      scene, [field = field, value = value](EngineState& state) { set(state, field, 0, value); }, comm);
  EXPECT_NE(ending.error.find("not finite"), std::string::npos) << ending.error;
  ASSERT_TRUE(ending.fault);
  EXPECT_EQ(ending.fault->particle.before.id, changed_id(scene, comm));
  EXPECT_NE(ending.error.find("particle " + std::to_string(ending.fault->particle.before.id) + " "), std::string::npos);
  EXPECT_EQ(ending.fault->rank, comm.size() - 1);
  // Within a window: all ranks meet at its end.
  EXPECT_LE(ending.steps, 2 * kWindow);
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
INSTANTIATE_TEST_SUITE_P(Fields, NotFinite,
                         testing::Values(std::tuple{"mixed", "velocity", kNan}, std::tuple{"double", "velocity", kNan},
                                         std::tuple{"mixed", "velocity", HUGE_VAL},
                                         std::tuple{"mixed", "elastic_strain", kNan},
                                         std::tuple{"mixed", "internal_energy", kNan},
                                         std::tuple{"double", "volume_change", kNan},
                                         std::tuple{"mixed", "velocity_gradient", kNan}));

// Energy whose pressure overflows: the state before is finite and stays, the one after is not.
TEST(Guard, StateBeforeAndAfter) {
  const mpi::Comm comm;
  const Scene scene = scene_with({"numerics.precision=mixed"});
  const Ending ending = ending_with(
      scene, [](EngineState& state) { set(state, "internal_energy", 0, 1e38); }, comm);
  ASSERT_TRUE(ending.fault) << ending.error;
  const grid::ParticleFault& p = ending.fault->particle;
  EXPECT_NEAR(p.before.values.energy / 1e38, 1.0, 1e-6);
  EXPECT_TRUE(std::isfinite(p.before.position.x + p.before.values.velocity.x + p.before.values.volume_ratio));
  EXPECT_FALSE(std::isfinite(p.after.pressure));
}

TEST(Guard, MoreThanACellInOneStep) {
  const mpi::Comm comm;
  const Scene scene = scene_with({});
  const double speed = 1.5 * scene.cell / *scene.time.step;
  const Ending ending = ending_with(
      scene, [&](EngineState& state) { set(state, "velocity", 2, 40 * speed); }, comm);
  EXPECT_NE(ending.error.find("moved more than a cell"), std::string::npos) << ending.error;
  ASSERT_TRUE(ending.fault);
  EXPECT_TRUE(ending.fault->particle.finite);
}

// Faster than the sorting interval was chosen for, though below a cell per step.
TEST(Guard, MoreThanACellBetweenSortings) {
  const mpi::Comm comm;
  const Scene scene = thin_scene({});
  const double speed = 0.3 * scene.cell / *scene.time.step;
  const Ending ending = ending_with(
      scene,
      [&](EngineState& state) {
        for (std::size_t n = 0; n < state.particles; ++n) set(state, "velocity", 1, speed, n);
      },
      comm);
  EXPECT_NE(ending.error.find("between two sortings, among them particle"), std::string::npos) << ending.error;
}

TEST(Guard, LostParticle) {
  const mpi::Comm comm;
  const Scene scene = scene_with({});
  const std::uint64_t lost = changed_id(scene, comm, last_id);
  const Ending ending = ending_with(
      scene,
      [](EngineState& state) {
        for (StateColumn& c : state.columns) c.values.resize(c.values.size() - c.element_bytes * c.components);
        state.node.resize(state.node.size() - 3);
        --state.particles;
      },
      comm);
  const std::string expected = " particles are left of ", id = ", without those of the ids " + std::to_string(lost);
  EXPECT_NE(ending.error.find(expected), std::string::npos) << ending.error;
  EXPECT_TRUE(ending.error.ends_with(id)) << ending.error;
}

// Each id on some rank: nothing is said; of many that are on none the first few.
TEST(Guard, MissingIdsAreNamed) {
  const mpi::Comm comm;
  constexpr std::uint64_t kTotal = (std::uint64_t{1} << 20) + 10;  // more than are compared at a time
  std::vector<std::uint64_t> ids;
  const auto ranks = static_cast<std::uint64_t>(comm.size());
  for (auto id = static_cast<std::uint64_t>(comm.rank()); id < kTotal; id += ranks) ids.push_back(id);
  EXPECT_EQ(missing_ids(ids, kTotal, comm), "");
  std::erase_if(ids, [](std::uint64_t id) { return id == 3 || id == kTotal - 1; });
  EXPECT_EQ(missing_ids(ids, kTotal, comm), "3, " + std::to_string(kTotal - 1));
  std::erase_if(ids, [](std::uint64_t id) { return id < 9; });
  EXPECT_EQ(missing_ids(ids, kTotal, comm), "0, 1, 2, 3, 4 and 5 others");
}

TEST(Guard, CollapseOfTheTimeStep) {
  const mpi::Comm comm;
  const Scene scene = scene_with({});
  TimeLoop loop(scene, resolve_effects(scene), 1, comm);
  Guard guard(scene, 1.0, comm);
  EXPECT_NO_THROW(guard.check_step(2.0 * Guard::kCollapse, loop.engine()));
  for (const double collapsed : {0.5 * Guard::kCollapse, 0.0, -1.0, kNan}) {
    EXPECT_THROW(guard.check_step(collapsed, loop.engine()), NumericsError) << collapsed;
  }
}

// Hard case 3: lone particles whose C says det(I + dt C) = -1/8 go on, and are counted.
TEST(Guard, ClampedVolumesAreCounted) {
  const mpi::Comm comm;
  const Scene scene =
      thin_scene({"effects.strength=off", "effects.damage=off", "effects.shear=off", "effects.viscosity=off"});
  const Ending plain = ending_with(
      scene, [](EngineState&) {}, comm);
  EXPECT_EQ(plain.error, "");
  EXPECT_EQ(plain.lost.clamped, 0U);
  const Ending ending = ending_with(
      scene,
      [&](EngineState& state) {
        for (std::size_t n = 0; n < state.particles; ++n) {
          for (const std::size_t diagonal : {0U, 4U, 8U}) {
            set(state, "velocity_gradient", diagonal, -1.5 / *scene.time.step, n);
          }
        }
      },
      comm);
  EXPECT_GE(comm.sum(ending.lost.clamped), 1U);
}

}  // namespace
}  // namespace breccia::sim::test

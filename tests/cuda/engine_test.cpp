// The CUDA engine, emulated, against the host engine: all effects, both precisions, halves of steps and whole ones,
// sortings, debris. And that its result depends on no order of lanes and blocks, to the bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "breccia/error.hpp"
#include "tests/cuda/engine_cases.hpp"

namespace breccia::cuda {
namespace {

struct Pair {
  std::unique_ptr<Engine> host, device;

  Pair(const Scene& scene, const material::RuntimeEffects& effects, int steps) {
    EngineSetup setup = setup_for(scene);
    setup.effects = effects;
    host = grid::make_host_engine(setup, self());
    device = make_cuda_engine(setup);
    for (Engine* engine : {host.get(), device.get()}) {
      fill(*engine, scene);
      advance(*engine, steps, kStep);
    }
  }
  [[nodiscard]] Difference difference() const { return compare(device->observe(), host->observe()); }
};

class CudaEngineTest : public testing::TestWithParam<Precision> {
 protected:
  void SetUp() override { cuda_emulation::set_order(Order::kRandom, 5); }
};

TEST_P(CudaEngineTest, CollisionEqualsHostEngine) {
  const Pair pair(small_impact(GetParam()), kRock, 200);
  expect_below(pair.difference(), GetParam());
  const ParticleOutput particles = pair.host->observe();
  EXPECT_GT(*std::max_element(particles.damage.begin(), particles.damage.end()), 0.5) << "damage is to be at work";
}

// More particles in a tile than a thread block has threads.
TEST_P(CudaEngineTest, FullTilesEqualHostEngine) {
  Scene scene = small_impact(GetParam());
  scene.cell *= 3.0;
  const double block = 4 * scene.cell;
  for (BodyParameters& body : scene.bodies) body.position += 0.5 * Vec3d{block, block, block};
  const Pair pair(scene, kRock, 40);
  expect_below(pair.difference(), GetParam());
  const ParticleOutput particles = pair.host->observe();
  const auto in_first_block = [&](const Vec3d& x) {
    return std::min({x.x, x.y, x.z}) > 0 && std::max({x.x, x.y, x.z}) < block - scene.cell;
  };
  // Of all threads of a block.
  const double viscous_work = pair.host->passes().viscous_work;
  EXPECT_NEAR(pair.device->passes().viscous_work, viscous_work,
              10 * (GetParam() == Precision::kDouble ? kDouble : kMixed) * viscous_work);
  EXPECT_GT(std::count_if(particles.position.begin(), particles.position.end(), in_first_block), kPassThreads);
}

TEST_P(CudaEngineTest, WorkAndCountsEqualHostEngine) {
  const Pair pair(small_impact(GetParam()), kRock, 58);
  const double tolerance = GetParam() == Precision::kDouble ? kDouble : kMixed;
  const grid::PassReport device = pair.device->passes(), host = pair.host->passes();
  EXPECT_GT(host.plastic_work, 0.0);
  EXPECT_NEAR(device.plastic_work, host.plastic_work, 10 * tolerance * host.plastic_work);
  EXPECT_NEAR(device.viscous_work, host.viscous_work, 10 * tolerance * host.viscous_work);
  EXPECT_NEAR(device.largest_move, host.largest_move, tolerance * host.largest_move);
  EXPECT_NEAR(pair.device->elastic_energy(), pair.host->elastic_energy(), tolerance * pair.host->elastic_energy());
  EXPECT_EQ(pair.device->stats().occupied_blocks, pair.host->stats().occupied_blocks);
  EXPECT_EQ(pair.device->stats().blocks, pair.host->stats().blocks);
}

TEST_P(CudaEngineTest, OtherEffectsEqualHostEngine) {
  for (const auto& effects : {kGranular, kFluid}) {
    Scene scene = small_impact(GetParam());
    const Pair pair(scene, effects, 40);
    expect_below(pair.difference(), GetParam());
  }
}

// What flies alone needs no grid on either device; who does changes with every sorting.
TEST_P(CudaEngineTest, DebrisEqualsHostEngine) {
  const Pair pair(debris(GetParam()), kRock, 25);
  expect_below(pair.difference(), GetParam());
  EXPECT_GT(pair.host->stats().lone_particles, 100U);
  EXPECT_EQ(pair.device->stats().lone_particles, pair.host->stats().lone_particles);
}

TEST_P(CudaEngineTest, TwoMaterialsWallsAndPeriodsEqualHostEngine) {
  Scene scene = small_impact(GetParam());
  for (BodyParameters& body : scene.bodies) body.velocity.x += 500.0;  // over the edge of the period
  scene.materials.push_back(scene.materials[0]);
  scene.materials[1].eos.rho0 = 3300.0;
  scene.materials[1].shear_modulus = 5e10;
  scene.bodies[1].material = 1;
  scene.bodies[1].mass *= 1.2;
  const double length = 5 * 4 * scene.cell;  // an odd number of blocks: bodies reach over the edge
  scene.boundaries = {{{0, -20e3, 0}, {0, 1, 0}, BoundaryKind::kFriction, 0.4},
                      {{0, 0, -25e3}, {0, 0, 1}, BoundaryKind::kSlip, 0.0},
                      {{0, 40e3, 0}, {0, -1, 0}, BoundaryKind::kStick, 0.0},
                      {{-40e3, 0, 0}, {1, 0, 0}, BoundaryKind::kPeriodic, 0.0},
                      {{-40e3 + length, 0, 0}, {-1, 0, 0}, BoundaryKind::kPeriodic, 0.0}};
  expect_below(Pair(scene, kRock, 60).difference(), GetParam());
}

// Nothing may hang on the order in which lanes, warps and blocks run: that is what a race would show as.
TEST_P(CudaEngineTest, ResultIsBitwiseTheSameInAnyOrder) {
  const Scene scene = debris(GetParam());
  std::vector<EngineState> states;
  for (const Order order : {Order::kForward, Order::kReverse, Order::kRandom}) {
    cuda_emulation::set_order(order, 3);
    const auto engine = make_cuda_engine(setup_for(scene));
    fill(*engine, scene);
    advance(*engine, 12, kStep);
    engine->gather(kStep);
    engine->sort();
    states.push_back(engine->save());
  }
  for (const EngineState& other : {states[1], states[2]}) {
    EXPECT_EQ(other.node, states[0].node);
    for (std::size_t c = 0; c < other.columns.size(); ++c) {
      EXPECT_EQ(other.columns[c].values, states[0].columns[c].values) << other.columns[c].name;
    }
  }
}

// A state goes from one device to the other; on its own it goes on with the same bits.
TEST_P(CudaEngineTest, RestoredStateGoesOn) {
  const Scene scene = small_impact(GetParam());
  const auto first = make_cuda_engine(setup_for(scene));
  fill(*first, scene);
  advance(*first, 12, kStep);
  first->gather(kStep);
  first->sort();
  const EngineState state = first->save();
  const auto second = make_cuda_engine(setup_for(scene));
  const auto host = grid::make_host_engine(setup_for(scene), self());
  const material::FlawLists flaws = first->flaws();
  second->restore(state, flaws);
  host->restore(state, flaws);
  for (Engine* engine : {first.get(), second.get(), host.get()}) advance(*engine, 12, kStep);
  const ParticleOutput a = first->observe(), b = second->observe();
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a.id[i], b.id[i]);
    ASSERT_EQ(a.position[i].x, b.position[i].x);
    ASSERT_EQ(a.velocity[i].z, b.velocity[i].z);
    ASSERT_EQ(a.internal_energy[i], b.internal_energy[i]);
  }
  expect_below(compare(a, host->observe()), GetParam());
}

// A step far too long is not taken silently.
TEST_P(CudaEngineTest, ParticlesThatMoveTooFarAreReported) {
  const Scene scene = small_impact(GetParam());
  const auto engine = make_cuda_engine(setup_for(scene));
  fill(*engine, scene);
  advance(*engine, 5, kStep);
  EXPECT_FALSE(engine->passes().fault.has_value());
  EXPECT_FALSE(engine->strayed());
  engine->gather(100.0);
  const grid::PassReport report = engine->passes();
  ASSERT_TRUE(report.fault.has_value());
  EXPECT_GE(report.largest_move, 1.0);
  EXPECT_GT(report.fault->before.values.velocity.x * report.fault->before.values.velocity.x, 1.0);
}

TEST_P(CudaEngineTest, GravityTimeStepAndDamageEndEqualHostEngine) {
  Scene scene = small_impact(GetParam());
  EngineSetup setup = setup_for(scene);
  setup.self_gravity = true;
  const auto host = grid::make_host_engine(setup, self());
  const auto device = make_cuda_engine(setup);
  const double tolerance = GetParam() == Precision::kDouble ? kDouble : kMixed;
  std::vector<Vec3d> position[2];
  for (Engine* engine : {host.get(), device.get()}) {
    fill(*engine, scene);
    std::vector<Vec3d>& x = position[engine == device.get() ? 1 : 0];
    std::vector<double> mass;
    engine->predict(10.0, x, mass);
    std::vector<Vec3d> pull;
    for (const Vec3d& at : x) pull.push_back(-1e-6 * at);  // each its own
    engine->hold_gravity(pull);
    engine->kick_velocities(-0.5 * kStep);
    advance(*engine, 30, kStep);
    EXPECT_FALSE(engine->finish_damage());
  }
  expect_below(compare(device->observe(), host->observe()), GetParam());
  const grid::SignalSpeeds a = device->signal_speeds(), b = host->signal_speeds();
  EXPECT_NEAR(a.sound, b.sound, tolerance * b.sound);
  EXPECT_NEAR(a.particle, b.particle, tolerance * b.particle);
  const std::vector<double> ratios[2] = {device->volume_ratios(), host->volume_ratios()};
  EXPECT_NEAR(*std::min_element(ratios[0].begin(), ratios[0].end()),
              *std::min_element(ratios[1].begin(), ratios[1].end()), tolerance);
}

// A graph of a step holds its dt.
TEST_P(CudaEngineTest, StepMayChange) {
  const Scene scene = debris(GetParam());
  const auto host = grid::make_host_engine(setup_for(scene), self());
  const auto device = make_cuda_engine(setup_for(scene));
  for (Engine* engine : {host.get(), device.get()}) {
    fill(*engine, scene);
    engine->scatter(0.5 * kStep);
    engine->update_grid(kStep);
    for (const double step : {kStep, kStep, 0.5 * kStep, 0.5 * kStep, kStep, kStep}) {
      engine->gather_scatter(step);
      engine->update_grid(step);
    }
  }
  expect_below(compare(device->observe(), host->observe()), GetParam());
}

TEST_P(CudaEngineTest, DamageEndsWhenAllIsBroken) {
  Scene scene = small_impact(GetParam());
  for (BodyParameters& body : scene.bodies) body.damage = 1.0;
  const Pair pair(scene, kRock, 21);
  for (Engine* engine : {pair.host.get(), pair.device.get()}) {
    engine->gather(kStep);
    EXPECT_TRUE(engine->finish_damage());
    engine->sort();
    advance(*engine, 20, kStep);
  }
  expect_below(pair.difference(), GetParam());
}

// A cell in eighteen steps.
TEST_P(CudaEngineTest, ParticlesThatStrayAreAnError) {
  Scene scene = small_impact(GetParam());
  for (BodyParameters& body : scene.bodies) body.velocity.y += 2300.0;
  const auto engine = make_cuda_engine(setup_for(scene));
  fill(*engine, scene);
  engine->scatter(0.5 * kStep);
  EXPECT_THROW(
      {
        for (int n = 0; n < 40; ++n) {
          engine->update_grid(kStep);
          engine->gather_scatter(kStep);
        }
        engine->sort();
      },
      NumericsError);
}

// Three launches and no wait of the host: the step that a run repeats.
TEST_P(CudaEngineTest, StepIsThreeLaunchesWithoutWaiting) {
  const Scene scene = debris(GetParam());
  const auto engine = make_cuda_engine(setup_for(scene));
  fill(*engine, scene);
  engine->scatter(0.5 * kStep);
  engine->update_grid(kStep);
  const std::uint64_t launches = cuda_emulation::launch_count();
  const std::uint64_t waits = cuda_emulation::synchronisation_count();
  for (int n = 0; n < 5; ++n) {
    engine->gather_scatter(kStep);
    engine->update_grid(kStep);
  }
  EXPECT_EQ(cuda_emulation::launch_count() - launches, 15U);
  EXPECT_EQ(cuda_emulation::synchronisation_count(), waits);
}

// What is asked of the device before a run is what it takes, and not much more; in dust there is nothing to spare.
TEST_P(CudaEngineTest, MemoryIsKnownBefore) {
  for (const Scene& scene : {small_impact(GetParam()), debris(GetParam()), dust(GetParam())}) {
    const EngineSetup setup = setup_for(scene);
    const auto host = grid::make_host_engine(setup, self());
    fill(*host, scene);
    const Load load = count_load(host->save(), host->flaws().threshold.size(), {}, true, {});
    const std::uint64_t needed = bytes_asked(setup, load);
    const auto device = make_cuda_engine(setup);
    const std::size_t before = cuda_emulation::most_bytes();
    cuda_emulation::forget_most_bytes();
    fill(*device, scene);
    EXPECT_EQ(device->stats().tiles, load.tiles);
    EXPECT_EQ(device->stats().blocks, load.blocks);
    device->scatter(0.5 * kStep);
    device->update_grid(kStep);
    device->gather(kStep);
    device->sort();
    device->scatter(0.5 * kStep);
    device->update_grid(kStep);
    (void)device->observe();
    EXPECT_LE(cuda_emulation::most_bytes(), needed + 4096) << before;  // and what no particle determines
    EXPECT_GE(cuda_emulation::most_bytes(), needed / 2);
  }
}

TEST_P(CudaEngineTest, TooLittleMemoryIsSaidBefore) {
  const Scene scene = small_impact(GetParam());
  setenv("BRECCIA_EMULATED_MEMORY", "100000", 1);
  const auto engine = make_cuda_engine(setup_for(scene));
  std::string message;
  try {
    fill(*engine, scene);
  } catch (const UsageError& error) {
    message = error.what();
  }
  unsetenv("BRECCIA_EMULATED_MEMORY");
  EXPECT_NE(message.find("has not enough memory for the particles"), std::string::npos) << message;
  EXPECT_NE(message.find(" needed by 1 rank ("), std::string::npos) << message;
  EXPECT_NE(message.find(" bytes), 0.01 GB available ("), std::string::npos) << message;
}

// What a device says when it is to run with these properties; empty if it does.
std::string refusal(const char* variable, const char* value, Precision precision) {
  setenv(variable, value, 1);
  std::string message;
  try {
    make_cuda_engine(setup_for(small_impact(precision)));
  } catch (const UsageError& error) {
    message = error.what();
  }
  unsetenv(variable);
  return message;
}

// Of little shared memory, of which mixed precision takes half, and of any other reason in the words of the runtime.
TEST_P(CudaEngineTest, UnfitDeviceIsRefusedWithTheReason) {
  const std::string of_shared_memory = refusal("BRECCIA_EMULATED_SHARED", "101376", GetParam());
  if (GetParam() == Precision::kDouble) {
    EXPECT_NE(of_shared_memory.find("101376 bytes of shared memory"), std::string::npos) << of_shared_memory;
  } else {
    EXPECT_EQ(of_shared_memory, "");
  }
  const std::string of_kernels = refusal("BRECCIA_EMULATED_CAPABILITY", "75", GetParam());
  EXPECT_NE(of_kernels.find("no kernel image is available"), std::string::npos) << of_kernels;
}

TEST_P(CudaEngineTest, FreesWhatItTook) {
  const std::size_t before = cuda_emulation::live_allocations();
  { const Pair pair(debris(GetParam()), kRock, 12); }
  EXPECT_EQ(cuda_emulation::live_allocations(), before);
}

INSTANTIATE_TEST_SUITE_P(Precisions, CudaEngineTest, testing::Values(Precision::kMixed, Precision::kDouble),
                         [](const auto& p) { return p.param == Precision::kMixed ? "mixed" : "double"; });

}  // namespace
}  // namespace breccia::cuda

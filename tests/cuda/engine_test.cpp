// The CUDA engine, emulated, against the host engine: all effects, both precisions, halves of steps and whole ones,
// sortings, debris. And that its result depends on no order of lanes and blocks, to the bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "breccia/error.hpp"
#include "cuda/cuda_engine.hpp"
#include "scene/bodies.hpp"

namespace breccia::cuda {
namespace {

using cuda_emulation::Order;
using grid::Engine;
using grid::EngineSetup;

mpi::Comm self() { return mpi::Comm(MPI_COMM_SELF); }

// Two small spheres, nearly touching, at 300 m/s: compression, shear, yield, flaws and damage within 60 steps.
Scene small_impact(Precision precision) {
  Scene scene;
  scene.cell = 6250.0;
  scene.materials.resize(1);
  for (int b = 0; b < 2; ++b) {
    BodyParameters body;
    body.semi_axes = {25e3, 25e3, 25e3};
    body.particles = 250;
    body.first_id = static_cast<std::uint64_t>(b) * body.particles;
    body.position = {b == 0 ? 26e3 : -26e3, b == 0 ? 5e3 : -5e3, 1e3 * b};
    body.velocity = {b == 0 ? -150.0 : 150.0, 10.0, -3.0};
    body.mass = 4.0 / 3.0 * 3.141592653589793 * 25e3 * 25e3 * 25e3 * 2700.0;
    scene.bodies.push_back(body);
  }
  scene.numerics.precision = precision;
  scene.gravity.uniform = {0.01, -0.02, 0.005};
  return scene;
}

// Two clouds with some twenty cells between particles, flying through each other: most share no node with another one,
// some do, and who does changes with every sorting. Their spin, meaningless as it is, strains and heats them.
Scene debris(Precision precision) {
  Scene scene = small_impact(precision);
  for (BodyParameters& body : scene.bodies) {
    body.lattice = Lattice::kRandom;
    body.semi_axes = {300e3, 300e3, 300e3};
    body.mass = static_cast<double>(body.particles) * 0.7 * 2700.0 * std::pow(scene.cell, 3);
    body.spin = {1e-3, -2e-3, 1.5e-3};
  }
  return scene;
}

EngineSetup setup_for(const Scene& scene) {
  EngineSetup setup;
  setup.cell = scene.cell;
  setup.materials = scene.materials;
  setup.boundaries = scene.boundaries;
  setup.uniform_gravity = scene.gravity.uniform;
  setup.numerics = scene.numerics;
  return setup;
}

material::FlawLists flaws_of(const Scene& scene, const ParticleArrays& particles) {
  material::FlawLists lists;
  lists.first.push_back(0);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const BodyParameters& body = scene.bodies[particles.body[i]];
    const std::uint64_t index = particles.id[i] - body.first_id;
    const auto one = material::draw_flaws(body.particles, body.mass / 2700.0, {}, 1, particles.body[i], {&index, 1});
    lists.threshold.insert(lists.threshold.end(), one.threshold.begin(), one.threshold.end());
    lists.first.push_back(static_cast<std::uint32_t>(lists.threshold.size()));
  }
  return lists;
}

std::unique_ptr<Engine> make_cuda_engine(const EngineSetup& setup) {
  if (setup.numerics.precision == Precision::kDouble)
    return std::make_unique<CudaEngine<DoublePrecision>>(setup, self());
  return std::make_unique<CudaEngine<MixedPrecision>>(setup, self());
}

void fill(Engine& engine, const Scene& scene) {
  const ParticleArrays particles = scene::make_particles(scene, self());
  std::vector<Vec3d> spins;
  for (const BodyParameters& body : scene.bodies) spins.push_back(body.spin);
  engine.insert(particles, flaws_of(scene, particles), spins);
}

// Sorts every 10 steps, then and every 7 steps in two halves.
void advance(Engine& engine, int steps, double dt) {
  engine.scatter(0.5 * dt);
  for (int n = 1; n < steps; ++n) {
    engine.update_grid(dt);
    if (n % 10 == 0 || n % 7 == 0) {
      engine.gather(dt);
      if (n % 10 == 0) engine.sort();
      engine.scatter(0.5 * dt);
    } else {
      engine.gather_scatter(dt);
    }
  }
  engine.update_grid(dt);
}

struct Difference {
  double position = 0.0, velocity = 0.0, energy = 0.0, damage = 0.0, density = 0.0, grid_density = 0.0, shear = 0.0;
};

std::vector<std::size_t> by_id(const ParticleOutput& p) {
  std::vector<std::size_t> place(p.size());
  for (std::size_t i = 0; i < p.size(); ++i) place[p.id[i]] = i;
  return place;
}

// Largest differences over the largest values (positions: over the size of the scene).
Difference compare(const ParticleOutput& a, const ParticleOutput& b) {
  const auto in_a = by_id(a);
  const auto in_b = by_id(b);
  Difference d;
  Difference largest{.shear = std::numeric_limits<double>::min()};  // 0 / 0 without shear
  const auto grow = [](double& to, double value) { to = value > to || std::isnan(value) ? value : to; };
  for (std::size_t id = 0; id < a.size(); ++id) {
    const std::size_t i = in_a[id], j = in_b[id];
    const Vec3d x = a.position[i] - b.position[j], v = a.velocity[i] - b.velocity[j];
    grow(d.position, std::sqrt(dot(x, x)));
    grow(d.velocity, std::sqrt(dot(v, v)));
    grow(d.energy, std::abs(a.internal_energy[i] - b.internal_energy[j]));
    grow(d.damage, std::abs(a.damage[i] - b.damage[j]));
    grow(d.density, std::abs(a.density[i] - b.density[j]));
    grow(d.grid_density, std::abs(a.grid_density[i] - b.grid_density[j]));
    if (!a.shear_stress.empty()) grow(d.shear, std::abs(a.shear_stress[i] - b.shear_stress[j]));
    grow(largest.position, std::sqrt(dot(b.position[j], b.position[j])));
    grow(largest.velocity, std::sqrt(dot(b.velocity[j], b.velocity[j])));
    grow(largest.energy, std::abs(b.internal_energy[j]));
    grow(largest.grid_density, b.grid_density[j]);
    if (!a.shear_stress.empty()) grow(largest.shear, b.shear_stress[j]);
  }
  return {d.position / largest.position,
          d.velocity / largest.velocity,
          d.energy / largest.energy,
          d.damage,
          d.density / 2700.0,
          d.grid_density / largest.grid_density,
          d.shear / largest.shear};
}

constexpr double kStep = 0.15;  // a sixth of what a wave needs for a cell [s]

const material::RuntimeEffects kRock{};
const material::RuntimeEffects kGranular{.damage = false, .fully_damaged = true};
const material::RuntimeEffects kFluid{.shear = false, .strength = false, .damage = false};

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

// What the project asks for after 200 steps of a collision.
constexpr double kDouble = 1e-11;
constexpr double kMixed = 1e-5;
// Strain is summed from differences of node velocities, which in float carry 1e-7 of 150 m/s: a thousandth of the small
// shear of rubble.
constexpr double kMixedShear = 1e-3;

void expect_below(const Difference& d, Precision precision) {
  const double tolerance = precision == Precision::kDouble ? kDouble : kMixed;
  EXPECT_LE(d.position, tolerance);
  EXPECT_LE(d.velocity, tolerance);
  EXPECT_LE(d.energy, tolerance);
  EXPECT_LE(d.damage, tolerance);
  EXPECT_LE(d.density, tolerance);
  EXPECT_LE(d.grid_density, tolerance);
  EXPECT_LE(d.shear, precision == Precision::kDouble ? kDouble : kMixedShear);
}

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
  EXPECT_EQ(pair.device->stats().tiles, pair.host->stats().tiles);
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
  const Pair pair(debris(GetParam()), kRock, 60);
  expect_below(pair.difference(), GetParam());
  EXPECT_GT(pair.host->stats().lone_particles, 100U);
  EXPECT_EQ(pair.device->stats().lone_particles, pair.host->stats().lone_particles);
}

TEST_P(CudaEngineTest, TwoMaterialsWallsAndPeriodsEqualHostEngine) {
  Scene scene = small_impact(GetParam());
  scene.materials.push_back(scene.materials[0]);
  scene.materials[1].eos.rho0 = 3300.0;
  scene.materials[1].shear_modulus = 5e10;
  scene.bodies[1].material = 1;
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
    advance(*engine, 25, kStep);
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
  advance(*first, 25, kStep);
  first->gather(kStep);
  first->sort();
  const EngineState state = first->save();
  const auto second = make_cuda_engine(setup_for(scene));
  const auto host = grid::make_host_engine(setup_for(scene), self());
  const material::FlawLists flaws = flaws_of(scene, first->inspect());
  second->restore(state, flaws);
  host->restore(state, flaws);
  for (Engine* engine : {first.get(), second.get(), host.get()}) advance(*engine, 25, kStep);
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

TEST_P(CudaEngineTest, ParticlesThatStrayAreAnError) {
  const Scene scene = small_impact(GetParam());
  const auto engine = make_cuda_engine(setup_for(scene));
  fill(*engine, scene);
  engine->scatter(0.5 * kStep);
  EXPECT_THROW(
      {
        for (int n = 0; n < 400; ++n) {
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

TEST_P(CudaEngineTest, FreesWhatItTook) {
  const std::size_t before = cuda_emulation::live_allocations();
  { const Pair pair(debris(GetParam()), kRock, 12); }
  EXPECT_EQ(cuda_emulation::live_allocations(), before);
}

INSTANTIATE_TEST_SUITE_P(Precisions, CudaEngineTest, testing::Values(Precision::kMixed, Precision::kDouble),
                         [](const auto& p) { return p.param == Precision::kMixed ? "mixed" : "double"; });

}  // namespace
}  // namespace breccia::cuda

// The CUDA engine on several ranks, each with an emulated device of its own, against the host engine on one: particles
// that migrate with their flaws, sums of shared blocks that travel on a stream of their own, by way of the host's
// memory or not, slabs that are cut anew.
#include <cstring>
#include <set>

#include "tests/cuda/engine_cases.hpp"
#include "tests/cuda/variable.hpp"

namespace breccia::cuda {
namespace {

class CudaRanks : public testing::TestWithParam<Precision> {
 protected:
  void SetUp() override { cuda_emulation::set_order(Order::kForward); }
  const mpi::Comm world_;
};

// Which particles a rank holds, between sort() and scatter().
std::set<std::uint64_t> ids(const Engine& engine) {
  const EngineState state = engine.save();
  const auto column =
      std::find_if(state.columns.begin(), state.columns.end(), [](const StateColumn& c) { return c.name == "id_low"; });
  std::set<std::uint64_t> found;
  for (std::size_t i = 0; i < state.particles; ++i) {
    std::uint32_t id = 0;
    std::memcpy(&id, column->values.data() + i * sizeof id, sizeof id);
    found.insert(id);
  }
  return found;
}

// True if particles have gone to other ranks.
bool expect_equal(const Scene& scene, int steps, const mpi::Comm& world) {
  const auto host = grid::make_host_engine(setup_for(scene), self());
  fill(*host, scene);
  advance(*host, steps, kStep);
  const auto device = make_cuda_engine(setup_for(scene), world);
  fill(*device, scene, world);
  const std::set<std::uint64_t> before = ids(*device);
  advance(*device, steps, kStep);
  const ParticleOutput mine = device->observe();
  EXPECT_EQ(world.sum(static_cast<std::uint64_t>(mine.size())), host->stats().particles);
  expect_below(compare(mine, host->observe()), scene.numerics.precision);
  return world.any(before != std::set(mine.id.begin(), mine.id.end()));
}

TEST_P(CudaRanks, CollisionEqualsHostEngine) {
  EXPECT_TRUE(expect_equal(drifting(small_impact(GetParam())), 100, world_));
}

TEST_P(CudaRanks, DebrisEqualsHostEngine) { EXPECT_TRUE(expect_equal(drifting(debris(GetParam())), 40, world_)); }

TEST_P(CudaRanks, PeriodsAndWallsEqualHostEngine) {
  Scene scene = drifting(small_impact(GetParam()));
  const double length = 5 * 4 * scene.cell;
  scene.boundaries = {{{0, -20e3, 0}, {0, 1, 0}, BoundaryKind::kFriction, 0.4},
                      {{-40e3, 0, 0}, {1, 0, 0}, BoundaryKind::kPeriodic, 0.0},
                      {{-40e3 + length, 0, 0}, {-1, 0, 0}, BoundaryKind::kPeriodic, 0.0}};
  expect_equal(scene, 40, world_);
}

// After some steps and a sorting.
EngineState state_of(const Scene& scene, const mpi::Comm& world) {
  const auto device = make_cuda_engine(setup_for(scene), world);
  fill(*device, scene, world);
  advance(*device, 15, kStep);
  device->gather(kStep);
  device->sort();
  return device->save();
}

void expect_same_bits(const EngineState& a, const EngineState& b) {
  EXPECT_EQ(a.node, b.node);
  for (std::size_t c = 0; c < a.columns.size(); ++c) {
    EXPECT_EQ(a.columns[c].values, b.columns[c].values) << a.columns[c].name;
  }
}

// Device memory to MPI, as where it is CUDA-aware (that of the emulation is the host's), and streams that run whenever
// they may: neither changes a bit.
TEST_P(CudaRanks, WayAndMomentOfTheExchangeChangeNothing) {
  const Scene scene = drifting(small_impact(GetParam()));
  const EngineState staged = state_of(scene, world_);
  {
    const Variable way("BRECCIA_CUDA_AWARE_MPI", "1");
    expect_same_bits(state_of(scene, world_), staged);
    cuda_emulation::set_order(Order::kRandom, 5);
    expect_same_bits(state_of(scene, world_), staged);
  }
  expect_same_bits(state_of(scene, world_), staged);
  const Variable driver("BRECCIA_EMULATED_DRIVER", "old");
  expect_same_bits(state_of(scene, world_), staged);
}

// Five launches, and no wait.
TEST_P(CudaRanks, StepNeverWaits) {
  const Scene scene = small_impact(GetParam());
  const auto engine = make_cuda_engine(setup_for(scene), world_);
  fill(*engine, scene, world_);
  engine->scatter(0.5 * kStep);
  engine->update_grid(kStep);
  ASSERT_GT(engine->stats().halo_bytes_per_step, 0U);
  const std::uint64_t launches = cuda_emulation::launch_count();
  const std::uint64_t waits = cuda_emulation::synchronisation_count();
  for (int n = 0; n < 5; ++n) {
    engine->gather_scatter(kStep);
    engine->update_grid(kStep);
  }
  EXPECT_LE(cuda_emulation::launch_count() - launches, 25U);
  EXPECT_EQ(cuda_emulation::synchronisation_count() - waits, 0U);
}

// What is asked of each device for the particles of its rank is what they take: in sortings after which some are
// another's, and at outputs.
TEST_P(CudaRanks, MemoryIsKnownBefore) {
  bool passed = false;
  for (Scene scene : {small_impact(GetParam()), dust(GetParam())}) {
    for (BodyParameters& body : scene.bodies) body.velocity.x += 3000.0;  // almost a cell between two sortings
    EngineSetup setup = setup_for(scene);
    const auto device = make_cuda_engine(setup, world_);
    setup.divide_blocks = false;
    const auto host = grid::make_host_engine(setup, world_);
    fill(*host, scene, world_);
    const auto needed = [&](const Engine& engine) {
      const OwnPlanes planes = planes_of_rank(engine.slabs(), world_.rank());
      return bytes_asked(setup, count_load(engine.save(), engine.flaws().threshold.size(), {}, true, planes));
    };
    const std::uint64_t before = needed(*host);
    cuda_emulation::forget_most_bytes();
    fill(*device, scene, world_);
    const std::set<std::uint64_t> own = ids(*device);
    advance(*device, 21, kStep);
    device->gather(kStep);
    device->sort();
    passed = passed || world_.any(ids(*device) != own);
    const std::uint64_t after = needed(*device);
    device->scatter(0.5 * kStep);
    device->update_grid(kStep);
    (void)device->observe();
    EXPECT_LE(cuda_emulation::most_bytes(), std::max(before, after) + 4096);
  }
  EXPECT_TRUE(passed);
}

// Particles that pass from rank to rank leave no flaws behind for ever: memory stays.
TEST_P(CudaRanks, FlawsOfParticlesThatHaveGoneAreDropped) {
  constexpr int cells = 24;
  constexpr std::uint32_t flaws_each = 50;
  Scene scene = small_impact(GetParam());
  scene.boundaries = {{{0, 0, 0}, {1, 0, 0}, BoundaryKind::kPeriodic, 0.0},
                      {{cells * scene.cell, 0, 0}, {-1, 0, 0}, BoundaryKind::kPeriodic, 0.0}};
  scene.gravity.uniform = {1e-9, 0, 0};  // too weak to be felt
  ParticleArrays row;  // of all ranks, as each finds its own; far apart along y, so that nothing deforms
  for (std::uint64_t n = 0; n < cells; ++n) {
    if (static_cast<int>(n) % world_.size() != world_.rank()) continue;
    row.id.push_back(n);
    row.position.push_back(scene.cell * Vec3d{static_cast<double>(n) + 0.3, 12.0 * static_cast<double>(n), 0.2});
    row.velocity.push_back({0.895 * scene.cell, 0.0, 0.0});
    row.mass.push_back(2700.0 * std::pow(scene.cell, 3));
    row.body.push_back(0);
    row.material.push_back(0);
    row.damage.push_back(0.0);
  }
  material::FlawLists flaws;
  for (std::size_t i = 0; i <= row.size(); ++i) flaws.first.push_back(static_cast<std::uint32_t>(i) * flaws_each);
  flaws.threshold.assign(row.size() * flaws_each, 1.0F);
  const auto engine = make_cuda_engine(setup_for(scene), world_);
  const std::vector<Vec3d> spin(1);
  engine->insert(row, flaws, spin);
  const auto held = [&] { return engine->stats().particle_bytes; };
  const auto moment = [&] {  // sum m x of what observers see, of all ranks
    const ParticleOutput p = engine->inspect();
    double sum = 0.0;
    for (std::size_t i = 0; i < p.size(); ++i) sum += p.mass[i] * p.position[i].x;
    return world_.sum(sum);
  };
  const double moment_before = moment();
  double work = -engine->work_beyond_period();
  std::uint64_t most_at_first = 0, most = 0;
  for (int n = 0; n < 3 * cells; ++n) {  // almost three times around
    engine->scatter(0.5);
    engine->update_grid(1.0);
    engine->gather(1.0);
    work += engine->sort();
    (n < cells ? most_at_first : most) = std::max(n < cells ? most_at_first : most, held());
    EXPECT_EQ(engine->flaws().threshold.size(), engine->flaws().first.size() * flaws_each - flaws_each);
  }
  // All flaws twice and the room that arrays keep; without the dropping three times as many as at first.
  EXPECT_LE(most, most_at_first + most_at_first / 8);
  // The field's work over the periods is that over the way less that over the change of what is seen. A float of 0.895
  // cells is rounded by 3e-8.
  const double way = 0.895 * scene.cell * 3 * cells * cells * 2700.0 * std::pow(scene.cell, 3);
  work = world_.sum(work + engine->work_beyond_period());
  EXPECT_NEAR(work, 1e-9 * (way - (moment() - moment_before)), 1e-6 * 1e-9 * way);
}

// A state goes on as it was, on the same ranks and, cut anew, on fewer.
TEST_P(CudaRanks, RestoredStateGoesOn) {
  const Scene scene = drifting(small_impact(GetParam()));
  const auto first = make_cuda_engine(setup_for(scene), world_);
  fill(*first, scene, world_);
  advance(*first, 15, kStep);
  first->gather(kStep);
  first->sort();
  EngineState state = first->save();
  const auto second = make_cuda_engine(setup_for(scene), world_);
  second->restore(state, first->flaws());
  state.same_ranks = false;
  const auto third = make_cuda_engine(setup_for(scene), world_);
  third->restore(state, first->flaws());
  for (Engine* engine : {first.get(), second.get(), third.get()}) {
    advance(*engine, 15, kStep);
    (void)engine->passes();  // or they would wait for each other, on one device
  }
  const ParticleOutput a = first->observe(), b = second->observe();
  ASSERT_EQ(a.id, b.id);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.position[i].x, b.position[i].x);
    EXPECT_EQ(a.velocity[i].y, b.velocity[i].y);
  }
  // Cut anew: other ranks may hold the particles, so their sums are compared.
  const auto momentum = [&](const ParticleOutput& p) {
    double x = 0.0;
    for (std::size_t i = 0; i < p.size(); ++i) x += p.mass[i] * p.velocity[i].x;
    return world_.sum(x);
  };
  EXPECT_NEAR(momentum(third->observe()) / momentum(a), 1.0, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Precisions, CudaRanks, testing::Values(Precision::kMixed, Precision::kDouble),
                         [](const auto& p) { return p.param == Precision::kMixed ? "mixed" : "double"; });

}  // namespace
}  // namespace breccia::cuda

// Gravity on the emulated device, on one rank and several: the field against the solvers of the host, and a whole
// impact with it against the host engine.
#include "sim/time_loop.hpp"
#include "tests/cuda/gravity_cases.hpp"

namespace breccia::cuda {
namespace {

std::unique_ptr<Engine> device_maker(const EngineSetup& setup, const mpi::Comm& comm) {
  return make_cuda_engine(setup, comm);
}

class CudaGravityTest : public testing::TestWithParam<Precision> {
 protected:
  void SetUp() override { cuda_emulation::set_order(Order::kForward); }
  [[nodiscard]] bool is_double() const { return GetParam() == Precision::kDouble; }
  const mpi::Comm world_;
};

TEST_P(CudaGravityTest, DirectSumEqualsHosts) {
  for (const double softening : {0.0, 500.0}) {
    const Parameters parameters{.softening = softening, .precision = GetParam()};
    const Fields fields = evaluate(small_impact(GetParam()), GravityMethod::kDirect, parameters, world_);
    EXPECT_LE(fields.largest, rounding(GetParam())) << softening;
    EXPECT_EQ(world_.sum(fields.device_stats.pairs), fields.host_stats.pairs);
    EXPECT_LE(fields.device_stats.momentum_error, rounding(GetParam()));
  }
}

// The same tree, the same cells for the same targets, on any number of ranks. Groups on the border between two ranks
// are summed by both.
TEST_P(CudaGravityTest, TreeEqualsHosts) {
  const Parameters parameters{.softening = is_double() ? 0.0 : 500.0, .precision = GetParam()};
  const Fields fields = evaluate(bodies(GetParam()), GravityMethod::kTree, parameters, world_);
  EXPECT_LE(fields.rms, is_double() ? 1e-12 : 3e-6);
  EXPECT_GT(fields.device_stats.cell_interactions, 0.0);
  EXPECT_GT(fields.device_stats.expansions, 0.0);
  if (world_.size() == 1) {
    EXPECT_EQ(fields.device_stats.pairs, fields.host_stats.pairs);
    EXPECT_EQ(fields.device_stats.cell_interactions, fields.host_stats.cell_interactions);
    EXPECT_EQ(fields.device_stats.expansions, fields.host_stats.expansions);
  }
  EXPECT_NEAR(fields.device_stats.momentum_error, fields.host_stats.momentum_error, 1e-6);
}

// Groups of debris are divided where the host divides them.
TEST_P(CudaGravityTest, TreeOfDebrisEqualsHosts) {
  const Fields fields = evaluate(two_crowds(GetParam()), GravityMethod::kTree, {.precision = GetParam()}, world_);
  EXPECT_LE(fields.rms, is_double() ? 1e-12 : 3e-6);
  if (world_.size() == 1) {
    EXPECT_EQ(fields.device_stats.pairs, fields.host_stats.pairs);
    EXPECT_EQ(fields.device_stats.expansions, fields.host_stats.expansions);
  }
}

// Two boxes and debris: mesh and near pairs inside each, trees for all other pairs. In mixed precision masses, mesh and
// short-range sums are floats on both sides, added in other orders.
TEST_P(CudaGravityTest, MeshEqualsHosts) {
  const Parameters parameters{.softening = is_double() ? 0.0 : 500.0, .precision = GetParam()};
  const Fields fields = evaluate(two_crowds(GetParam()), GravityMethod::kTreePm, parameters, world_);
  EXPECT_LE(fields.rms, is_double() ? 1e-12 : 3e-6);
  EXPECT_EQ(fields.device_stats.boxes, 2);
  EXPECT_EQ(fields.host_stats.boxes, 2);
  // Clusters of 32 targets in place of 16 see more, and those on the border of ranks are summed by both.
  EXPECT_NEAR(world_.sum(fields.device_stats.pairs) / fields.host_stats.pairs, 1.2, 0.4);
}

// Counts and lists, scans and sums: none may depend on which thread comes first.
TEST_P(CudaGravityTest, FieldIsBitwiseTheSameInAnyOrder) {
  Scene scene = crowd(GetParam());
  for (BodyParameters& body : scene.bodies) body.particles = 250;
  for (std::size_t b = 0; b < 3; ++b) scene.bodies[b].first_id = 250 * b;
  for (const GravityMethod method : {GravityMethod::kDirect, GravityMethod::kTree}) {
    std::vector<std::vector<Vec3d>> fields;
    for (const Order order : {Order::kForward, Order::kReverse, Order::kRandom}) {
      cuda_emulation::set_order(order, 3);
      const auto engine = loaded(scene, world_);
      dynamic_cast<gravity::ResidentParticles&>(*engine)
          .make_resident_solver(method, {.precision = GetParam()})
          ->evaluate_and_hold(20.0);
      fields.push_back(held(*engine, GetParam()));
    }
    for (const auto& other : fields) {
      for (std::size_t i = 0; i < other.size(); ++i) {
        ASSERT_EQ(other[i].x, fields[0][i].x);
        ASSERT_EQ(other[i].y, fields[0][i].y);
        ASSERT_EQ(other[i].z, fields[0][i].z);
      }
    }
  }
}

// No rank and no pair is a special case: all particles on one rank, one particle, none at all.
TEST_P(CudaGravityTest, FewParticlesAreFine) {
  for (const std::size_t particles : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
    EngineSetup setup = setup_for(small_impact(GetParam()));
    setup.self_gravity = true;
    const auto engine = make_cuda_engine(setup, world_);
    ParticleArrays mine;
    material::FlawLists flaws;
    flaws.first.assign(1, 0U);
    for (std::size_t i = 0; i < (world_.is_root() ? particles : 0); ++i) {
      mine.id.push_back(i);
      mine.position.push_back({1e5 * static_cast<double>(i), 0.0, 0.0});
      mine.velocity.push_back({});
      mine.mass.push_back(1e15);
      mine.body.push_back(0);
      mine.material.push_back(0);
      mine.damage.push_back(0.0);
      flaws.first.push_back(0U);
    }
    const std::vector<Vec3d> spins(1);
    engine->insert(mine, flaws, spins);
    for (const GravityMethod method : {GravityMethod::kDirect, GravityMethod::kTree, GravityMethod::kAuto}) {
      dynamic_cast<gravity::ResidentParticles&>(*engine)
          .make_resident_solver(method, {.precision = GetParam()})
          ->evaluate_and_hold(0.0);
      const double expected = particles == 2 ? 6.6743e-11 * 1e15 / 1e10 : 0.0;
      for (const Vec3d& a : held(*engine, GetParam())) EXPECT_NEAR(std::abs(a.x), expected, 1e-6 * expected);
    }
  }
}

// The whole impact, time step for time step as a run takes them: gravity every 32 steps at predicted positions.
TEST_P(CudaGravityTest, ImpactEqualsHostEngine) {
  Scene scene = small_impact(GetParam());
  scene.time.step = kStep;
  sim::ResolvedEffects effects{
      .material = kRock, .gravity = true, .gravity_method = GravityMethod::kDirect, .decisions = {}};
  const auto run = [&](sim::TimeLoop& loop) {
    loop.run([](const sim::TimeLoop& l) { return l.step() < 200; });
    return loop.engine().observe();
  };
  sim::TimeLoop host(scene, effects, 1, self());
  sim::TimeLoop device(scene, effects, 1, world_, &device_maker);
  const ParticleOutput expected = run(host);
  expect_below(compare(run(device), expected), GetParam());
  // Held accelerations of 0.02 m/s2 for 30 s are a four hundredth of the speed.
  effects.gravity = false;
  sim::TimeLoop without(scene, effects, 1, self());
  EXPECT_GT(compare(run(without), expected).velocity, 1e-3) << "gravity is to be at work";
}

INSTANTIATE_TEST_SUITE_P(Precisions, CudaGravityTest, testing::Values(Precision::kMixed, Precision::kDouble),
                         [](const auto& p) { return p.param == Precision::kMixed ? "mixed" : "double"; });

}  // namespace
}  // namespace breccia::cuda

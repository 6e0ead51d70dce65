// The CUDA engine on several ranks, each with an emulated device of its own, against the host engine on one: particles
// that migrate with their flaws, sums of shared blocks, slabs that are cut anew.
#include <cstring>
#include <set>

#include "tests/cuda/engine_cases.hpp"

namespace breccia::cuda {
namespace {

// Both bodies cross the planes between ranks, which lie across x.
Scene drifting(Scene scene) {
  for (BodyParameters& body : scene.bodies) body.velocity.x += 600.0;
  return scene;
}

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
  for (Engine* engine : {first.get(), second.get(), third.get()}) advance(*engine, 15, kStep);
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

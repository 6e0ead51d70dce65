// Gravity on the emulated device, on one rank and several: the field against the solvers of the host, and a whole
// impact with it against the host engine.
#include <cstring>

#include "gravity/resident.hpp"
#include "grid/state_columns.hpp"
#include "sim/time_loop.hpp"
#include "tests/cuda/engine_cases.hpp"

namespace breccia::cuda {
namespace {

using gravity::Parameters;

std::unique_ptr<Engine> device_maker(const EngineSetup& setup, const mpi::Comm& comm) {
  return make_cuda_engine(setup, comm);
}

class CudaGravityTest : public testing::TestWithParam<Precision> {
 protected:
  void SetUp() override { cuda_emulation::set_order(Order::kForward); }
  [[nodiscard]] bool is_double() const { return GetParam() == Precision::kDouble; }
  const mpi::Comm world_;
};

// A column of a saved state.
template <class T>
std::vector<T> column(const EngineState& state, const char* field, std::size_t components) {
  const StateColumn& c = grid::find_column(state, field, sizeof(T), components);
  std::vector<T> values(state.particles * components);
  if (!values.empty()) std::memcpy(values.data(), c.values.data(), c.values.size());
  return values;
}

// The accelerations that the particles of this rank hold.
std::vector<Vec3d> held(const Engine& engine, Precision precision) {
  const EngineState state = engine.save();
  std::vector<Vec3d> a(state.particles);
  const auto read = [&](auto zero) {
    const auto values = column<decltype(zero)>(state, "gravity", 3);
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] = {static_cast<double>(values[3 * i]), static_cast<double>(values[3 * i + 1]),
              static_cast<double>(values[3 * i + 2])};
    }
  };
  precision == Precision::kDouble ? read(0.0) : read(0.0F);
  return a;
}
std::vector<std::int32_t> ids(const Engine& engine) { return column<std::int32_t>(engine.save(), "id_low", 1); }

std::unique_ptr<Engine> loaded(const Scene& scene, const mpi::Comm& comm) {
  EngineSetup setup = setup_for(scene);
  setup.self_gravity = true;
  auto engine = make_cuda_engine(setup, comm);
  fill(*engine, scene, comm);
  return engine;
}

// A field on the devices of all ranks, and the same from the host's solver on one rank for the same predicted
// positions.
struct Fields {
  gravity::Stats device_stats, host_stats;
  double rms = 0.0;      // of |difference| / |a|
  double largest = 0.0;  // |difference| over the largest |a|
};
Fields evaluate(const Scene& scene, GravityMethod method, const Parameters& parameters, const mpi::Comm& comm) {
  constexpr double ahead = 20.0;
  const auto engine = loaded(scene, comm);
  const auto resident = dynamic_cast<gravity::ResidentParticles&>(*engine).make_resident_solver(method, parameters);
  if (!resident) throw UsageError("the device has not this method");
  resident->evaluate_and_hold(ahead);

  const auto all = loaded(scene, self());
  std::vector<Vec3d> position;
  std::vector<double> mass;
  all->predict(ahead, position, mass);
  std::vector<Vec3d> expected(position.size());
  const auto solver = gravity::make_solver(method, parameters, self(), 1);
  solver->evaluate({position, mass}, expected, {});
  std::vector<Vec3d> by_id(position.size());
  const std::vector<std::int32_t> id = ids(*all);
  for (std::size_t i = 0; i < id.size(); ++i) by_id[static_cast<std::size_t>(id[i])] = expected[i];

  Fields fields{resident->last(), solver->last()};
  const std::vector<Vec3d> found = held(*engine, scene.numerics.precision);
  const std::vector<std::int32_t> found_id = ids(*engine);
  double squares = 0.0, largest_field = 0.0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Vec3d a = by_id[static_cast<std::size_t>(found_id[i])];
    const Vec3d d = found[i] - a;
    squares += dot(d, d) / dot(a, a);
    fields.largest = std::max(fields.largest, std::sqrt(dot(d, d)));
    largest_field = std::max(largest_field, std::sqrt(dot(a, a)));
  }
  EXPECT_EQ(comm.sum(static_cast<std::uint64_t>(found.size())), position.size());
  fields.rms = std::sqrt(comm.sum(squares) / static_cast<double>(position.size()));
  fields.largest = comm.max(fields.largest) / comm.max(largest_field);
  return fields;
}

// Sums of 500 terms in another order: their roundings, 1e-16 and 6e-8, as a random walk, twice over.
double rounding(Precision precision) { return precision == Precision::kDouble ? 1e-14 : 3e-6; }

TEST_P(CudaGravityTest, DirectSumEqualsHosts) {
  for (const double softening : {0.0, 500.0}) {
    const Parameters parameters{.softening = softening, .precision = GetParam()};
    const Fields fields = evaluate(small_impact(GetParam()), GravityMethod::kDirect, parameters, world_);
    EXPECT_LE(fields.largest, rounding(GetParam())) << softening;
    EXPECT_EQ(world_.sum(fields.device_stats.pairs), fields.host_stats.pairs);
    EXPECT_LE(fields.device_stats.momentum_error, rounding(GetParam()));
  }
}

void number(Scene& scene) {
  std::uint64_t id = 0;
  for (BodyParameters& body : scene.bodies) {
    body.first_id = id;
    id += body.particles;
  }
}

// Two bodies: cells of all sizes, and targets of all kinds.
Scene bodies(Precision precision) {
  Scene scene = small_impact(precision);
  for (BodyParameters& body : scene.bodies) body.particles = 1200;
  number(scene);
  return scene;
}

// The same with ejecta far around them.
Scene crowd(Precision precision) {
  Scene scene = bodies(precision);
  scene.bodies.push_back(scene.bodies[0]);
  BodyParameters& ejecta = scene.bodies.back();
  ejecta.lattice = Lattice::kRandom;
  ejecta.particles = 700;
  ejecta.semi_axes = {900e3, 300e3, 300e3};
  ejecta.mass *= 0.1;
  number(scene);
  return scene;
}

// The same tree, the same cells for the same targets, on any number of ranks. Groups on the border between two ranks
// are summed by both.
TEST_P(CudaGravityTest, TreeEqualsHosts) {
  for (const double softening : {0.0, 500.0}) {
    const Parameters parameters{.softening = softening, .precision = GetParam()};
    const Fields fields = evaluate(bodies(GetParam()), GravityMethod::kTree, parameters, world_);
    EXPECT_LE(fields.rms, is_double() ? 1e-12 : 3e-6) << softening;
    EXPECT_GT(fields.device_stats.cell_interactions, 0.0);
    EXPECT_GT(fields.device_stats.expansions, 0.0);
    if (world_.size() == 1) {
      EXPECT_EQ(fields.device_stats.pairs, fields.host_stats.pairs);
      EXPECT_EQ(fields.device_stats.cell_interactions, fields.host_stats.cell_interactions);
      EXPECT_EQ(fields.device_stats.expansions, fields.host_stats.expansions);
    }
    EXPECT_NEAR(fields.device_stats.momentum_error, fields.host_stats.momentum_error, 1e-6);
  }
}

// Groups of debris are divided where the host divides them.
TEST_P(CudaGravityTest, TreeOfDebrisEqualsHosts) {
  const Fields fields = evaluate(crowd(GetParam()), GravityMethod::kTree, {.precision = GetParam()}, world_);
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
  Scene scene = crowd(GetParam());
  scene.bodies[1].position.x = -500e3;  // too far for one mesh over both
  const Fields fields = evaluate(scene, GravityMethod::kTreePm, parameters, world_);
  EXPECT_LE(fields.rms, is_double() ? 1e-12 : 3e-6);
  EXPECT_EQ(fields.device_stats.boxes, 2);
  EXPECT_EQ(fields.host_stats.boxes, 2);
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

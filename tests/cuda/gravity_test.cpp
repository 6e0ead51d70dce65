// Gravity on the emulated device, on one rank and several: the field against the solvers of the host, and a whole
// impact with it against the host engine.
#include "breccia/random.hpp"
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

// The accelerations that the particles of this rank hold.
std::vector<Vec3d> held(const Engine& engine, Precision precision) {
  const EngineState state = engine.save();
  std::vector<Vec3d> a(state.particles);
  const auto read = [&](auto zero) {
    using Real = decltype(zero);
    const StateColumn& column = grid::find_column(state, "gravity", sizeof(Real), 3);
    for (std::size_t i = 0; i < a.size(); ++i) {
      Real v[3];
      std::memcpy(v, column.values.data() + i * sizeof v, sizeof v);
      a[i] = {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
    }
  };
  precision == Precision::kDouble ? read(0.0) : read(0.0F);
  return a;
}

// A field on the device and the same from the host's solver for the same predicted positions.
struct Fields {
  gravity::Stats device_stats, host_stats;
  double rms = 0.0;      // of |difference| / |a|
  double largest = 0.0;  // |difference| over the largest |a|
};
Fields evaluate(const Scene& scene, GravityMethod method, const Parameters& parameters, const mpi::Comm& comm) {
  constexpr double ahead = 20.0;
  EngineSetup setup = setup_for(scene);
  setup.self_gravity = true;
  const auto engine = make_cuda_engine(setup, comm);
  fill(*engine, scene, comm);
  const auto resident = dynamic_cast<gravity::ResidentParticles&>(*engine).make_resident_solver(method, parameters);
  if (!resident) throw UsageError("the device has not this method");
  resident->evaluate_and_hold(ahead);

  std::vector<Vec3d> position;
  std::vector<double> mass;
  engine->predict(ahead, position, mass);
  std::vector<Vec3d> expected(position.size());
  const auto solver = gravity::make_solver(method, parameters, comm, 1);
  solver->evaluate({position, mass}, expected, {});

  Fields fields{resident->last(), solver->last()};
  const std::vector<Vec3d> found = held(*engine, scene.numerics.precision);
  EXPECT_EQ(found.size(), expected.size());
  double squares = 0.0, largest_field = 0.0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Vec3d d = found[i] - expected[i];
    squares += dot(d, d) / dot(expected[i], expected[i]);
    fields.largest = std::max(fields.largest, std::sqrt(dot(d, d)));
    largest_field = std::max(largest_field, std::sqrt(dot(expected[i], expected[i])));
  }
  const auto all = static_cast<double>(comm.sum(static_cast<std::uint64_t>(found.size())));
  fields.rms = std::sqrt(comm.sum(squares) / all);
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
    EXPECT_EQ(world_.sum(fields.device_stats.pairs), world_.sum(fields.host_stats.pairs));
    EXPECT_LE(fields.device_stats.momentum_error, rounding(GetParam()));
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

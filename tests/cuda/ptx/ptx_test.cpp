// The code that nvcc emits, executed: the engine on the emulated device, every kernel of it translated from PTX.
#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "tests/cuda/faulty_runs.hpp"
#include "tests/cuda/gravity_cases.hpp"
#include "tests/cuda/mesh_cases.hpp"
#include "tests/cuda/ptx/ptx_machine.hpp"

namespace breccia::cuda {
namespace {

// While it lives, translations run instead of kernels.
class Translated {
 public:
  Translated(const char* table, const char* arch) {
    cuda_emulation::substitute_kernels(&cuda_ptx::translations(table, arch));
  }
  ~Translated() { cuda_emulation::substitute_kernels(nullptr); }
  Translated(const Translated&) = delete;
  Translated& operator=(const Translated&) = delete;
};

class Ptx : public testing::TestWithParam<std::tuple<const char*, Precision>> {
 protected:
  void SetUp() override { cuda_emulation::set_order(Order::kRandom, 5); }
  [[nodiscard]] const char* arch() const { return std::get<0>(GetParam()); }
  [[nodiscard]] Precision precision() const { return std::get<1>(GetParam()); }
  // The code for both is the same so far: one of them runs long.
  [[nodiscard]] int steps(int most) const { return std::string_view(arch()) == "sm_90" ? most : most / 5; }
};

// Each particle has a pull of its own, and velocities begin half a step early.
void pull(Engine& engine) {
  std::vector<Vec3d> position;
  std::vector<double> mass;
  engine.predict(0.0, position, mass);
  for (Vec3d& x : position) x = -1e-6 * x;
  engine.hold_gravity(position);
  engine.kick_velocities(-0.5 * kStep);
}

// Quotients and roots of floats are up to two units in the last place off here (translate.py), as the device's may be.
// With that, and with fused multiply-adds, mixed precision was seen to differ by 3e-6 at most, of a tolerance of 1e-5;
// shear by 1.4e-5 and velocity gradients by 4e-6, for which rounding of velocities alone asks more (impact_cases.hpp).
void expect_equal_to_host(const Scene& scene, const EngineSetup& setup, int steps, const mpi::Comm& comm = self()) {
  const auto host = grid::make_host_engine(setup, self());
  const auto device = make_cuda_engine(setup, comm);
  fill(*host, scene);
  fill(*device, scene, comm);
  for (Engine* engine : {host.get(), device.get()}) {
    if (setup.self_gravity) pull(*engine);
    advance(*engine, steps, kStep);
  }
  expect_below(compare(device->observe(), host->observe()), scene.numerics.precision);
  const grid::SignalSpeeds a = device->signal_speeds(), b = host->signal_speeds();
  const double tolerance = scene.numerics.precision == Precision::kDouble ? kDouble : kMixed;
  EXPECT_NEAR(a.sound, b.sound, tolerance * b.sound);
  const double work = host->passes().viscous_work;
  EXPECT_NEAR(comm.sum(device->passes().viscous_work), work, 10 * tolerance * work);
  EXPECT_FALSE(device->strayed());
  EXPECT_EQ(device->finish_damage(), host->finish_damage());
}

// Rubble between walls, with gravity. In float, the last bit decides in which step a rock at the limit of a flaw begins
// to crack.
void expect_rubble_equal_to_host(Scene scene, int steps, const mpi::Comm& comm = self()) {
  scene.boundaries = {{{0, -20e3, 0}, {0, 1, 0}, BoundaryKind::kFriction, 0.4},
                      {{0, 0, -25e3}, {0, 0, 1}, BoundaryKind::kSlip, 0.0}};
  EngineSetup setup = setup_for(scene);
  setup.effects = kGranular;
  setup.self_gravity = true;
  expect_equal_to_host(scene, setup, steps, comm);
}

// In fewer than twenty steps there is so little strain that its rounding shows; after twenty a flaw of one particle is
// within the rounding of floats of its threshold.
TEST_P(Ptx, CollisionEqualsHostEngine) {
  const Translated translated("production", arch());
  const Scene scene = small_impact(precision());
  expect_equal_to_host(scene, setup_for(scene), std::max(steps(40), 24));
}

TEST_P(Ptx, DebrisEqualsHostEngine) {
  const Translated translated("production", arch());
  const Scene scene = debris(precision());
  expect_equal_to_host(scene, setup_for(scene), steps(12));  // a sorting, and a step in two halves
}

TEST_P(Ptx, WallsEqualHostEngine) {
  const Translated translated("production", arch());
  expect_rubble_equal_to_host(small_impact(precision()), steps(25));
}

// Without fused multiply-adds nvcc and g++ do the same arithmetic: every bit of a state after a sorting is the same.
TEST_P(Ptx, BitsAreThoseOfTheHostCompiler) {
  for (const Scene& scene : {small_impact(precision()), debris(precision())}) {
    std::vector<EngineState> states;
    const auto run = [&] {
      const auto engine = make_cuda_engine(setup_for(scene));
      fill(*engine, scene);
      advance(*engine, steps(12), kStep);
      engine->gather(kStep);
      engine->sort();
      states.push_back(engine->save());
    };
    run();
    {
      const Translated translated("unfused", arch());
      run();
    }
    EXPECT_EQ(states[1].node, states[0].node);
    for (std::size_t c = 0; c < states[0].columns.size(); ++c) {
      EXPECT_EQ(states[1].columns[c].values, states[0].columns[c].values) << states[0].columns[c].name;
    }
  }
}

// All kernels of gravity: boxes with meshes, and trees between them and the debris around.
TEST_P(Ptx, GravityEqualsHost) {
  const Translated translated("production", arch());
  const Parameters parameters{.softening = 500.0, .precision = precision()};
  const Fields direct = evaluate(small_impact(precision()), GravityMethod::kDirect, parameters, self());
  EXPECT_LE(direct.largest, rounding(precision()));
  const Fields mesh = evaluate(two_crowds(precision()), GravityMethod::kTreePm, parameters, self());
  EXPECT_LE(mesh.rms, precision() == Precision::kDouble ? 1e-12 : 3e-6);
  EXPECT_EQ(mesh.device_stats.boxes, 2);
}

TEST_P(Ptx, CountsOfBlocksAreHosts) {
  const Translated translated("production", arch());
  expect_counts_are_hosts();
}

TEST_P(Ptx, ShortRangeLawsEqualHosts) {
  const Translated translated("production", arch());
  precision() == Precision::kDouble ? expect_box_is_hosts<double>(self()) : expect_box_is_hosts<float>(self());
}

// What only several ranks launch: lists of tiles, sums of shared blocks, planes of a mesh that come together.
class PtxOnRanks : public Ptx {
 protected:
  const mpi::Comm world_;
};

TEST_P(PtxOnRanks, WallsEqualHostEngine) {
  const Translated translated("production", arch());
  expect_rubble_equal_to_host(drifting(small_impact(precision())), 12, world_);
}

TEST_P(PtxOnRanks, PotentialIsHosts) {
  const Translated translated("production", arch());
  precision() == Precision::kDouble ? expect_potential_is_hosts<double>(world_)
                                    : expect_potential_is_hosts<float>(world_);
}

const auto kAll =
    testing::Combine(testing::Values("sm_80", "sm_90"), testing::Values(Precision::kMixed, Precision::kDouble));
std::string name_of(const testing::TestParamInfo<Ptx::ParamType>& p) {
  return std::string(std::get<0>(p.param)) + (std::get<1>(p.param) == Precision::kMixed ? "_mixed" : "_double");
}
INSTANTIATE_TEST_SUITE_P(All, Ptx, kAll, name_of);
INSTANTIATE_TEST_SUITE_P(All, PtxOnRanks, kAll, name_of);

// Comes after all others of one rank, and looks at what these have run.
class PtxKernels : public testing::TestWithParam<const char*> {};

TEST_P(PtxKernels, HaveAllRun) {
  std::vector<std::string> never;
  for (const auto& [name, kernel] : cuda_ptx::translations("production", GetParam())) {
    if (kernel.launches == 0) never.push_back(name);
  }
  EXPECT_EQ(never, (std::vector<std::string>{"collect_shared<double>", "collect_shared<float>", "take_nodes<double>",
                                             "take_nodes<float>"}))
      << "beside those of PtxOnRanks";
}
INSTANTIATE_TEST_SUITE_P(All, PtxKernels, testing::Values("sm_80", "sm_90"),
                         [](const auto& p) { return std::string(p.param); });

// Mistakes in what nvcc emits are found at the access or barrier.
class PtxFaults : public testing::Test {
 protected:
  const Translated translated_{"faulty", "sm_90"};
};
using namespace cuda_test;

TEST_F(PtxFaults, RightKernelIsRight) {
  for (const Order order : {Order::kForward, Order::kReverse, Order::kRandom})
    EXPECT_EQ(run<Fault::kNone>(order), kSum);
}
TEST_F(PtxFaults, MissingBarrierShowsAsUninitialisedMemory) {
  EXPECT_NE(run<Fault::kNoBarrier>(Order::kForward), kSum);
}
TEST_F(PtxFaults, EarlyExitBeforeABarrier) {
  EXPECT_TRUE(says(error_of<Fault::kEarlyExit>(), "thread 5: left before the barrier of line"));
}
TEST_F(PtxFaults, DifferentBarriers) {
  EXPECT_TRUE(says(error_of<Fault::kDivergentBarrier>(), "waits at the barrier of line"));
}
TEST_F(PtxFaults, ShuffleWithLanesThatNeverCome) {
  EXPECT_TRUE(says(error_of<Fault::kLostLane>(), "before the warp function"));
}
TEST_F(PtxFaults, SharedMemoryOverrun) {
  EXPECT_TRUE(says(error_of<Fault::kOverrun>(), "shared access out of range or not aligned: 4 bytes at 260 of 260"))
      << error_of<Fault::kOverrun>();
}
TEST_F(PtxFaults, GlobalMemoryOverrun) {
  EXPECT_TRUE(says(error_of<Fault::kGlobalOverrun>(), "global access out of range"));
}
TEST_F(PtxFaults, KernelWithoutTranslation) { EXPECT_TRUE(says(error_of<Fault::kNoAtomic>(), "has no translation")); }

}  // namespace
}  // namespace breccia::cuda

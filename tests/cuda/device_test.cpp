// The engine of the library that the program loads, on the device there is, against the host engine: tools/gpu-check
// runs this on a GPU, the tests with the library of the emulated device. BRECCIA_DEVICE_STEPS: steps of a scene.
#include "grid/device.hpp"

#include <cstdlib>

#include "tests/cuda/impact_cases.hpp"

namespace breccia::cuda {
namespace {

int steps() {
  const char* wanted = std::getenv("BRECCIA_DEVICE_STEPS");
  return wanted == nullptr ? 200 : std::atoi(wanted);
}

class DeviceTest : public testing::TestWithParam<Precision> {
 protected:
  static std::unique_ptr<Engine> make_device_engine(const EngineSetup& setup) {
    return grid::choose_engine(grid::Device::kCuda, setup.numerics.precision, self()).make(setup, self());
  }
  static void expect_equal(const Scene& scene, const material::RuntimeEffects& effects, double mixed = kMixed) {
    EngineSetup setup = setup_for(scene);
    setup.effects = effects;
    const auto host = grid::make_host_engine(setup, self());
    const auto device = make_device_engine(setup);
    for (Engine* engine : {host.get(), device.get()}) {
      fill(*engine, scene);
      advance(*engine, steps(), kStep);
    }
    expect_below(compare(device->observe(), host->observe()), scene.numerics.precision, mixed);
  }
};

TEST_P(DeviceTest, CollisionEqualsHostEngine) { expect_equal(small_impact(GetParam()), kRock); }
// Where two particles just touch, a node holds next to no mass: its velocity has the rounding of what little it is
// divided by, and a device rounds otherwise (fused multiply-adds, division to two units in the last place). 2e-5 on an
// H100, of densities.
TEST_P(DeviceTest, DebrisEqualsHostEngine) { expect_equal(debris(GetParam()), kRock, 10 * kMixed); }
TEST_P(DeviceTest, RubbleEqualsHostEngine) { expect_equal(small_impact(GetParam()), kGranular); }
TEST_P(DeviceTest, WallsAndPeriodsEqualHostEngine) {
  Scene scene = small_impact(GetParam());
  const double length = 5 * 4 * scene.cell;
  scene.boundaries = {{{0, -20e3, 0}, {0, 1, 0}, BoundaryKind::kFriction, 0.4},
                      {{-40e3, 0, 0}, {1, 0, 0}, BoundaryKind::kPeriodic, 0.0},
                      {{-40e3 + length, 0, 0}, {-1, 0, 0}, BoundaryKind::kPeriodic, 0.0}};
  expect_equal(scene, kRock);
}

// Nothing is added in an order that is left to chance.
TEST_P(DeviceTest, RunRepeatsBitForBit) {
  const Scene scene = debris(GetParam());
  std::vector<EngineState> states;
  for (int run = 0; run < 2; ++run) {
    const auto engine = make_device_engine(setup_for(scene));
    fill(*engine, scene);
    advance(*engine, steps(), kStep);
    engine->gather(kStep);
    engine->sort();
    states.push_back(engine->save());
  }
  EXPECT_EQ(states[1].node, states[0].node);
  for (std::size_t c = 0; c < states[0].columns.size(); ++c) {
    EXPECT_EQ(states[1].columns[c].values, states[0].columns[c].values) << states[0].columns[c].name;
  }
}

INSTANTIATE_TEST_SUITE_P(Precisions, DeviceTest, testing::Values(Precision::kMixed, Precision::kDouble),
                         [](const auto& p) { return p.param == Precision::kMixed ? "mixed" : "double"; });

}  // namespace
}  // namespace breccia::cuda

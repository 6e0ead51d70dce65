// The stability limit of the step: where it truly is, and what happens beyond (physics.md 8: 22, 29).
#include "sim/step_size.hpp"
#include "tests/stability/hard_scene.hpp"

namespace breccia::sim::test {
namespace {

// A shock tube: a bar, periodic across, flies into a wall at 100 m/s. Elastic and with heat and artificial viscosity,
// whose linear term makes the step's limit half of the acoustic one.
std::string shock_tube(double step) {
  std::string text = R"([scene]
end = "10 s"
[grid]
cell = "1 m"
[[body]]
shape = "box"
lattice = "cubic"
spacing = "0.5 m"
size = ["32 m", "4 m", "4 m"]
position = ["16 m", "2 m", "2 m"]
velocity = ["-100 m/s", 0, 0]
[effects]
gravity = "off"
damage = false
strength = false
[[boundary]]
normal = [1, 0, 0]
kind = "slip"
[[boundary]]
normal = [0, 1, 0]
kind = "periodic"
[[boundary]]
point = [0, "4 m", 0]
normal = [0, -1, 0]
kind = "periodic"
[[boundary]]
normal = [0, 0, 1]
kind = "periodic"
[[boundary]]
point = [0, 0, "4 m"]
normal = [0, 0, -1]
kind = "periodic"
)";
  return text + "[time]\nstep = \"" + seconds(step) + "\"\n";
}

// The limit as the program estimates it from the material at rest, without the factor time.cfl.
double estimated_limit() {
  Scene scene = load(shock_tube(1.0));
  scene.time.step.reset();
  return stable_step(scene, initial_speeds(scene, true), true).seconds / scene.time.cfl;
}

// What an unstable step does is gain energy; a percent of the kinetic energy at the start is far above rounding, and
// reached within a few steps once a mode grows. Beyond that the numbers overflow and the budget throws.
enum class Fate { kStable, kGains, kThrows };
struct Ending {
  Fate fate;
  std::string error{};
};
Ending ending(double step, const std::string& precision) {
  const Scene scene = load(shock_tube(step), {"numerics.precision=" + precision});
  try {
    // 20 ms: the wave has crossed the bar twice. No particle travels half a cell between sortings then.
    const Course course = follow(scene, {.time = 0.02}, mpi::Comm(MPI_COMM_SELF));
    return {course.gained > 0.01 * course.first.kinetic_energy ? Fate::kGains : Fate::kStable};
  } catch (const NumericsError& error) {
    return {Fate::kThrows, error.what()};
  }
}

class StepLimit : public testing::TestWithParam<const char*> {};

// Half of the estimated limit is what time.cfl = 0.4 and reason allow: stable.
TEST_P(StepLimit, HalfOfTheEstimateIsStable) {
  EXPECT_EQ(ending(0.5 * estimated_limit(), GetParam()).fate, Fate::kStable);
}

// Three times the limit: it is the energy guard that ends the run, before a number overflows.
TEST_P(StepLimit, ThreeTimesTheEstimateIsCaught) {
  const Ending end = ending(3.0 * estimated_limit(), GetParam());
  EXPECT_EQ(end.fate, Fate::kThrows);
  EXPECT_NE(end.error.find("numerics.energy_gain"), std::string::npos) << end.error;
}

// The true limit by bisection, reported. The estimate must be on the safe side and not wasteful: between it and twice
// that.
TEST_P(StepLimit, TheEstimateIsSafeAndNotWasteful) {
  const double estimate = estimated_limit();
  double stable = 0.5, unstable = 4.0;
  while (unstable - stable > 0.1) {
    const double middle = 0.5 * (stable + unstable);
    (ending(middle * estimate, GetParam()).fate == Fate::kStable ? stable : unstable) = middle;
  }
  RecordProperty("true_limit_over_estimate", std::to_string(stable));
  std::printf("true limit / estimate: %.2f\n", stable);
  EXPECT_GT(stable, 1.0);
  EXPECT_LT(stable, 2.5);
}

INSTANTIATE_TEST_SUITE_P(Precisions, StepLimit, testing::Values("mixed", "double"));

}  // namespace
}  // namespace breccia::sim::test

// The errors that gravity.md 7 allows, at the number of particles for which openings are largest.
#include <gtest/gtest.h>

#include "bench/gravity_states.hpp"
#include "gravity/verify.hpp"

namespace breccia::gravity {
namespace {

constexpr std::int64_t kParticles = 1'000'000;
constexpr std::int64_t kTargets = 4000;
constexpr int kThreads = 1;

struct Level {
  GravityMethod method;
  double error;     // asked for
  double rms, p99;  // allowed
};

class Million : public testing::TestWithParam<char> {};

TEST_P(Million, ErrorsAreThoseAskedFor) {
  const bench::GravityState state = bench::gravity_state(GetParam(), kParticles);
  const ParticlesView particles{state.position, state.mass};
  const mpi::Comm comm;
  std::vector<std::int64_t> targets;
  for (std::int64_t k = 0; k < kTargets; ++k) targets.push_back(kParticles * k / kTargets);
  const std::vector<Vec3d> exact = direct_acceleration(particles, targets, state.softening, comm, kThreads);
  std::vector<Vec3d> a(state.position.size());
  for (const Level level : {Level{GravityMethod::kTree, 1e-3, 1e-3, 3e-3},
                            {GravityMethod::kTree, 3.5e-4, 3.5e-4, 1.3e-3},
                            {GravityMethod::kTree, 1.2e-4, 1.2e-4, 3.5e-4},
                            {GravityMethod::kTreePm, 3.5e-4, 3.5e-4, 1.6e-3},
                            {GravityMethod::kTreePm, 1e-4, 1.2e-4, 3.5e-4}}) {
    const Parameters parameters{.softening = state.softening, .error = level.error};
    make_solver(level.method, parameters, comm, kThreads)->evaluate(particles, a, {});
    std::vector<Vec3d> is;
    for (const std::int64_t i : targets) is.push_back(a[static_cast<std::size_t>(i)]);
    const FieldErrors e = field_errors(is, exact, comm);
    EXPECT_LT(e.rms, level.rms) << "error " << level.error;
    EXPECT_LT(e.p99, level.p99) << "error " << level.error;
  }
}

INSTANTIATE_TEST_SUITE_P(States, Million, testing::Values('a', 'b', 'c'));

}  // namespace
}  // namespace breccia::gravity

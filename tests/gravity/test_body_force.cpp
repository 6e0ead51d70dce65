// The net force on dense bodies: what is said of it, what it is, and what method follows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bench/gravity_states.hpp"
#include "deal_out.hpp"
#include "gravity/mesh/layout.hpp"
#include "gravity/verify.hpp"
#include "third_law.hpp"

namespace breccia::gravity {
namespace {

constexpr double kError = 3.5e-4;

double norm(Vec3d a) { return std::sqrt(dot(a, a)); }

// States of gravity.md 3 and two spheres far apart (bench/gravity_states.hpp).
struct Measured {
  Stats stats;
  double body_error;  // as in body_force.hpp
  double of_pull;     // over the pull itself
};

class State {
 public:
  State(char name, std::int64_t particles) : state_(bench::gravity_state(name, particles)) {
    pull_ = pull_on_body(view(), state_.in_body, state_.softening, comm_, 1);
  }

  [[nodiscard]] Measured by(GravityMethod method, double opening = 0.0) const {
    const auto solver =
        make_solver(method, {.softening = state_.softening, .error = kError, .opening = opening}, comm_, 1);
    std::vector<Vec3d> a(state_.position.size());
    solver->evaluate(view(), a, {});
    double own = 0.0, mass = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (state_.in_body[i] == 0) continue;
      own += state_.mass[i] * norm(a[i]);
      mass += state_.mass[i];
    }
    own /= mass;
    const double spurious = norm(mean_acceleration(view(), state_.in_body, a, comm_) - pull_);
    return {solver->last(), spurious / std::max(norm(pull_), kLeastPull * own), spurious / norm(pull_)};
  }

  [[nodiscard]] Vec3d pull() const { return pull_; }
  [[nodiscard]] const bench::GravityState& particles() const { return state_; }

 private:
  [[nodiscard]] ParticlesView view() const { return {state_.position, state_.mass}; }

  mpi::Comm comm_;
  bench::GravityState state_;
  Vec3d pull_;
};

// Two spheres pull each other as points; the lattices are jittered and not quite round, which 200 km off still counts
// 2e-4 of it.
TEST(PullOnBody, OfASphereIsThatOfAPoint) {
  const State state('a', 8000);
  const double mass = state.particles().mass.front() * 4000;
  EXPECT_NEAR(state.pull().x, kGravitationalConstant * mass / (2e5 * 2e5), 1e-3 * state.pull().x);
  EXPECT_NEAR(norm(state.pull()), state.pull().x, 1e-3 * state.pull().x);
}

// So a million particles need no pairs (gravity_million).
TEST(PullOnBody, IsItsReaction) {
  for (const char name : {'b', 'c'}) {
    const State state(name, 24'000);
    const bench::GravityState& s = state.particles();
    const Vec3d reaction = pull_by_third_law({s.position, s.mass}, s.in_body, s.softening);
    EXPECT_LT(norm(reaction - state.pull()), 5e-5 * norm(state.pull())) << "state " << name;
  }
}

// What auto takes disturbs no body by more than is allowed. In (c) the largest fragment holds an eighth of the mass.
TEST(BodyForce, OfWhatAutoTakesIsWithinTheTolerance) {
  for (const char name : {'a', 'b', 'c', 'p', 'q'}) {
    const Measured m = State(name, 24'000).by(GravityMethod::kAuto);
    EXPECT_LT(m.body_error, kBodyTolerance * kError) << "state " << name << ": " << m.stats.reason;
  }
}

// The mesh leaves next to nothing: gravity.md 7 asks for 1e-5 of the pull in (a), and 5,000 km apart it pulls only by
// 1e-4 of the own gravity, a thousand roundings of float. The tree's net force has no other size there than at 200 km.
TEST(BodyForce, OfTheMeshIsThatOfRoundings) {
  EXPECT_LT(State('a', 24'000).by(GravityMethod::kTreePm).of_pull, 1e-5);
  const State far('q', 24'000);
  EXPECT_LT(far.by(GravityMethod::kTreePm).of_pull, 1e-3);
  EXPECT_GT(far.by(GravityMethod::kTree).of_pull, 3e-3);
}

// What is said beforehand is a typical value: single evaluations have up to thrice as much, or nearly nothing.
TEST(BodyForce, OfTheTreeIsWhatIsSaidOfIt) {
  for (const double opening : {1.2e-4, 2e-3}) {
    double said = 0.0, measured = 0.0;
    for (const std::int64_t particles : {16'000, 20'000, 24'000, 28'000}) {
      const State state('q', particles);
      measured += std::pow(state.by(GravityMethod::kTree, opening).body_error, 2) / 4.0;
      const auto half = static_cast<std::uint64_t>(particles / 2);
      const DenseBody body{.particles = half, .mass_share = 0.5, .pull = 0.0};
      said += std::pow(body_error_of_tree({{body}}, opening), 2) / 4.0;
    }
    EXPECT_LT(std::sqrt(measured), 1.5 * std::sqrt(said)) << opening;
    EXPECT_GT(std::sqrt(measured), 0.3 * std::sqrt(said)) << opening;
  }
}

// Far apart, bodies of 12,000 particles are the tree's by the price. With an opening wider than the error asks for it
// would disturb them too much.
TEST(BodyForce, DecidesForTheMesh) {
  const State far('q', 24'000);
  EXPECT_EQ(far.by(GravityMethod::kAuto).stats.method, GravityMethod::kTree);
  constexpr double kWide = 4e-3;
  const Measured chosen = far.by(GravityMethod::kAuto, kWide);
  EXPECT_EQ(chosen.stats.method, GravityMethod::kTreePm);
  EXPECT_NE(chosen.stats.reason.find("net force on a dense body"), std::string::npos) << chosen.stats.reason;
  EXPECT_LT(chosen.body_error, kBodyTolerance * kError);
  EXPECT_GT(far.by(GravityMethod::kTree, kWide).body_error, kBodyTolerance * kError);
}

TEST(Weigh, PullsOfPointsOverTheMeanGravityOfSpheres) {
  const double radius = 5e4;
  const double volume = 4.0 / 3.0 * kPi * std::pow(radius, 3);
  const PlacedBody one{.particles = 1000, .mass = 2e18, .volume = volume, .centre = {}};
  PlacedBody other = one;
  other.centre = {0, 0, 10.0 * radius};
  const PlacedBody bodies[] = {one, other};
  const std::vector<DenseBody> weighed = weigh(bodies, 5e18);
  ASSERT_EQ(weighed.size(), 2U);
  EXPECT_NEAR(weighed[0].pull, 4.0 / 3.0 / 100.0, 1e-12);
  EXPECT_NEAR(weighed[1].mass_share, 0.4, 1e-12);
  EXPECT_EQ(weigh({bodies, 1}, 2e18)[0].pull, 0.0);
}

// A body that is everything there is gets no force by itself, as the net force is taken off; nor does one whose mesh
// holds everything, but for roundings.
TEST(BodyError, OfLoneBodies) {
  const DenseBody alone{.particles = 50'000, .mass_share = 1.0, .pull = 0.0};
  EXPECT_EQ(body_error_of_tree({{alone}}, 1.2e-4), 0.0);
  EXPECT_LT(body_error_of_mesh({{alone}}, 1.2e-4), 2e-5);
  const DenseBody half{.particles = 50'000, .mass_share = 0.5, .pull = 0.0};
  DenseBody near = half;
  near.pull = 0.1;
  EXPECT_NEAR(body_error_of_tree({{half}}, 1.2e-4) / body_error_of_tree({{near}}, 1.2e-4), 10.0, 1e-9);
  // The worst body counts, and debris disturbs those in a mesh too.
  EXPECT_EQ(body_error_of_tree({{half, near}}, 1.2e-4), body_error_of_tree({{half}}, 1.2e-4));
  EXPECT_GT(body_error_of_mesh({{half}}, 1.2e-4), 10.0 * body_error_of_mesh({{half, half}}, 1.2e-4));
}

}  // namespace
}  // namespace breccia::gravity

// Hard cases of the grid (physics.md 8): nearly empty nodes, faces and negative coordinates, lone particles, drift.
#include <gtest/gtest.h>

#include <cmath>

#include "breccia/error.hpp"
#include "grid/engine.hpp"

namespace breccia::grid {
namespace {

constexpr double kCell = 2500.0;
constexpr double kMass = 3e13;

EngineSetup setup_for(Precision precision, bool lone_without_grid = true) {
  EngineSetup setup;
  setup.cell = kCell;
  setup.materials.resize(1);
  setup.effects = {.damage = false, .fully_damaged = true};
  setup.numerics.precision = precision;
  setup.numerics.lone_without_grid = lone_without_grid;
  return setup;
}

// The particles are dealt to the ranks in turn.
ParticleArrays particles_at(const std::vector<Vec3d>& x, const std::vector<Vec3d>& v, const mpi::Comm& comm,
                            double mass) {
  ParticleArrays p;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (static_cast<int>(i) % comm.size() != comm.rank()) continue;
    p.id.push_back(i);
    p.position.push_back(x[i]);
    p.velocity.push_back(v[i]);
    p.mass.push_back(mass);
    p.body.push_back(0);
    p.material.push_back(0);
    p.damage.push_back(1.0);
  }
  return p;
}

std::unique_ptr<Engine> engine_with(const EngineSetup& setup, const std::vector<Vec3d>& x, const std::vector<Vec3d>& v,
                                    const mpi::Comm& comm, double mass = kMass) {
  auto engine = make_host_engine(setup, comm);
  const ParticleArrays p = particles_at(x, v, comm, mass);
  material::FlawLists none;
  none.first.assign(p.size() + 1, 0U);
  const Vec3d no_spin[1] = {};
  engine->insert(p, none, no_spin);
  return engine;
}

// `steps` steps up to a t_n at which the engine can be observed, the particles sorted after every `sort_every` of them.
// `swept`: the other steps gather and scatter in one sweep.
void advance(Engine& engine, double dt, int steps, int sort_every, bool swept) {
  engine.scatter(0.5 * dt);
  for (int n = 1; n <= steps; ++n) {
    engine.update_grid(dt);
    const bool sorts = n % sort_every == 0;
    if (swept && !sorts) {
      engine.gather_scatter(dt);
      continue;
    }
    engine.gather(dt);
    if (sorts) engine.sort();
    engine.scatter(0.5 * dt);
  }
  engine.update_grid(dt);
}

// Cases 1, 2 and 18: positions on faces, at half cells, a hair beside them, on both sides of zero. A lone particle must
// move straight on whatever its weights are: the affine field of one particle is reproduced exactly.
void expect_straight(Precision precision, bool lone_without_grid, double mass) {
  std::vector<Vec3d> x;
  const double offsets[] = {0.0, -0.0, 0.5, -0.5, 0.5 + 1e-12, 0.5 - 1e-12, 1e-9, -1e-9, 0.25, 1.5, -1.5 + 1e-7};
  double far = 0.0;
  for (const double a : offsets) {
    for (const double b : offsets)
      x.push_back(Vec3d{(a + far) * kCell, (b - far) * kCell, (a - b) * kCell}), far += 40.0;
  }
  // The node across the corner gets delta^6 / 8 of the mass: of 1 kg from what a float still holds, 1e-38, to nothing.
  for (double delta = 2e-8; delta < 2e-6; delta *= 1.25, far += 40.0) {
    x.push_back(kCell * Vec3d{0.5 - delta + far, 0.5 - delta - far, 0.5 - delta});
  }
  const std::vector<Vec3d> v(x.size(), Vec3d{3.0, -100.0, 0.25});
  const mpi::Comm comm;
  const auto engine = engine_with(setup_for(precision, lone_without_grid), x, v, comm, mass);
  EXPECT_EQ(comm.sum(engine->stats().lone_particles) > 0, lone_without_grid);
  const double dt = 0.1220703125;
  constexpr int kSteps = 200;
  advance(*engine, dt, kSteps, 16, false);
  const ParticleOutput out = engine->observe();
  // Mixed: 6e-8 of 100 m/s per step may go one way for all 200 steps: 1.2e-3 m/s, 0.03 m.
  const double tolerance = precision == Precision::kMixed ? 0.05 : 1e-8;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Vec3d expected = x[out.id[i]] + (kSteps * dt) * v[0];
    EXPECT_NEAR(out.position[i].x, expected.x, tolerance) << "particle " << out.id[i];
    EXPECT_NEAR(out.position[i].y, expected.y, tolerance) << "particle " << out.id[i];
    EXPECT_NEAR(out.position[i].z, expected.z, tolerance) << "particle " << out.id[i];
  }
  EXPECT_EQ(comm.sum<std::uint64_t>(out.size()), x.size());
}
TEST(HardCases, LoneParticleMovesStraightFromAnywhereInACell) {
  for (const Precision precision : {Precision::kMixed, Precision::kDouble}) {
    for (const bool lone_without_grid : {false, true}) expect_straight(precision, lone_without_grid, kMass);
    expect_straight(precision, false, 1.0);
  }
}

// Case 12, in small: 1 m/s at 2e7 m. Over 1e4 steps of 0.12 s a float position would not move at all.
void expect_slow_drift(bool lone_without_grid) {
  const mpi::Comm comm;
  const auto engine =
      engine_with(setup_for(Precision::kMixed, lone_without_grid), {{2e7, -2e7, 2e7}}, {{1.0, 0.0, 0.0}}, comm);
  const double dt = 0.1220703125;
  constexpr int kSteps = 10000;
  advance(*engine, dt, kSteps, 32, true);
  const ParticleOutput out = engine->observe();
  // 1 m/s dt is 209715.2 units of 2^-32 cells, rounded to 0.2 of them: 1e-6 of 1220.7 m.
  for (const Vec3d& x : out.position) EXPECT_NEAR(x.x, 2e7 + kSteps * dt, 0.01);
}
TEST(HardCases, SlowDriftFarAwayIsNotLost) {
  for (const bool lone_without_grid : {false, true}) expect_slow_drift(lone_without_grid);
}

// Case 13: particles spread over 4e7 m cost their number, not the volume between them.
TEST(HardCases, FarLoneParticlesCostBlocksByTheirNumber) {
  const mpi::Comm comm;
  std::vector<Vec3d> x;
  for (int i = 0; i < 1000; ++i) {
    const double r = 4e7 * (i + 1) / 1000.0;
    x.push_back({r * std::cos(i), r * std::sin(i), r * std::cos(2.0 * i)});
  }
  const std::vector<Vec3d> v(1000, Vec3d{400, 0, 0});
  // A particle reaches 5 nodes an axis: at most 2 blocks an axis. Without a grid it has none; near the cut between two
  // ranks nobody knows whether it is alone.
  EXPECT_LE(comm.sum(engine_with(setup_for(Precision::kMixed, false), x, v, comm)->stats().blocks), 8U * 1000U);
  EXPECT_LE(comm.sum(engine_with(setup_for(Precision::kMixed), x, v, comm)->stats().blocks),
            comm.size() == 1 ? 0U : 8U * 100U);
}

// Case 29 in small and the margin: a particle that crosses more than a cell between two sortings is an error on every
// rank, not a silent loss.
void expect_too_fast(bool lone_without_grid) {
  const mpi::Comm comm;
  const auto engine =
      engine_with(setup_for(Precision::kMixed, lone_without_grid), {{0, 0, 0}}, {{40000.0, 0.0, 0.0}}, comm);
  const double dt = 0.05;  // 0.8 cells a step: the fourth one reaches a block it could not reach when it was sorted
  engine->scatter(0.5 * dt);
  for (int n = 0; n < 4; ++n) {
    engine->update_grid(dt);
    engine->gather_scatter(dt);
  }
  engine->update_grid(dt);
  engine->gather(dt);
  EXPECT_THROW(engine->sort(), NumericsError);
}
TEST(HardCases, TooFastForTheSortIntervalIsAnErrorOnAllRanks) {
  expect_too_fast(false);
  expect_too_fast(true);
}

// What strayed leaves nothing behind for the next engine of the process, that of a reproducible run included: there the
// sums of a tile are kept apart from the grid.
TEST(HardCases, AStrayLeavesNothingToTheNextEngine) {
  const mpi::Comm comm;
  EngineSetup setup = setup_for(Precision::kMixed, false);
  setup.numerics.reproducible = true;
  // Those that stray share their tile's third cells with others that do not; the rest begins at its first.
  const auto run = [&](double first_cell, bool strays) {
    std::vector<Vec3d> x, v;
    for (int i = 0; i < 64; ++i) {
      const double at[3] = {0.3 * (i % 4), 0.3 * (i / 4 % 4), 0.3 * (i / 16)};
      x.push_back(kCell * Vec3d{first_cell + at[0], first_cell + at[1], first_cell + at[2]});
      v.push_back(strays && i % 7 == 0 ? Vec3d{40000.0, 40000.0, 40000.0} : Vec3d{0.1 * i, 0.0, -0.05 * i});
    }
    const auto engine = engine_with(setup, x, v, comm);
    advance(*engine, 0.05, 6, 100, true);
    return engine->inspect();
  };
  const ParticleOutput before = run(0.0, false);
  run(2.0, true);
  const ParticleOutput after = run(0.0, false);
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    EXPECT_EQ(after.velocity[i].x, before.velocity[i].x);
    EXPECT_EQ(after.velocity[i].z, before.velocity[i].z);
  }
}

TEST(HardCases, BeyondTheKeysIsAUsageError) {
  const mpi::Comm comm;
  EXPECT_THROW(engine_with(setup_for(Precision::kMixed), {{1.1e10, 0, 0}}, {{0, 0, 0}}, comm), UsageError);
}

// A cut through the block beside a particle: what lies behind it is not known here, so it does not go without grid.
TEST(HardCases, NeighboursAcrossACutThroughABlock) {
  const mpi::Comm comm;
  const auto engine =
      engine_with(setup_for(Precision::kMixed), {{3.0 * kCell, 0, 0}, {6.0 * kCell, 0, 0}}, {{}, {}}, comm);
  engine->cut(mpi::Slabs(0, std::vector<std::int32_t>(static_cast<std::size_t>(comm.size()) - 1, 6)));
  EXPECT_EQ(engine->stats().particles, comm.size() == 1 ? 2U : comm.rank() == 0 || comm.rank() + 1 == comm.size());
  EXPECT_EQ(comm.sum(engine->stats().lone_particles), 0U);
}

// Well inside the tile, but another rank knows of no node that far.
TEST(HardCases, MoreThanANodeBesideACutIsTooFar) {
  const mpi::Comm comm;
  const auto engine = engine_with(setup_for(Precision::kMixed), {{4.0 * kCell, 0, 0}, {6.0 * kCell, 0, 0}},
                                  {{15000.0, 0.0, 0.0}, {15000.0, 0.0, 0.0}}, comm);
  engine->cut(mpi::Slabs(0, std::vector<std::int32_t>(static_cast<std::size_t>(comm.size()) - 1, 6)));
  const double dt = 0.1;  // 0.6 cells
  engine->scatter(0.5 * dt);
  for (int n = 0; n < 2; ++n) {
    engine->update_grid(dt);
    engine->gather_scatter(dt);
  }
  engine->update_grid(dt);
  engine->gather(dt);
  EXPECT_EQ(comm.any(engine->strayed()), comm.size() > 1);
}

// Several cells in one step, over several slabs: the particle arrives at its new owner with everything it carries.
TEST(HardCases, ParticlesFindTheirOwnersAgain) {
  const mpi::Comm comm;
  std::vector<Vec3d> x;
  std::vector<Vec3d> v;
  for (int i = 0; i < 64; ++i) {
    x.push_back({i * 4.0 * kCell, 0.0, 0.0});
    v.push_back({i % 2 == 0 ? 15000.0 : -15000.0, 0.0, 0.0});
  }
  const auto engine = engine_with(setup_for(Precision::kDouble), x, v, comm);
  const double dt = 0.1;  // 0.6 cells
  advance(*engine, dt, 40, 1, false);
  const ParticleOutput out = engine->observe();
  std::uint64_t ids = 0;
  for (const std::uint64_t id : out.id) ids += id;
  EXPECT_EQ(comm.sum<std::uint64_t>(out.size()), 64U);
  EXPECT_EQ(comm.sum(ids), 64U * 63U / 2U);
}

}  // namespace
}  // namespace breccia::grid

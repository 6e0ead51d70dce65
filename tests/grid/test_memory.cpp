// What the engine holds, and that it computes the same where it gives memory back between the uses of an array: where
// nodes are few beside particles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "breccia/precision.hpp"
#include "breccia/random.hpp"
#include "grid/engine.hpp"
#include "grid/particles.hpp"

namespace breccia::grid {
namespace {

constexpr double kCell = 2500.0;
constexpr double kMass = 5e12;
constexpr double kStep = 0.1;
constexpr int kEdge = 28;  // cells of the cube, whole blocks

// Broken rock: a cube with 8 particles in each cell, every particle with a velocity of its own. `far`: pairs of
// particles elsewhere, which have many nodes for themselves and meet nothing.
ParticleArrays cube_and_pairs(int far, const mpi::Comm& comm) {
  ParticleArrays p;
  const RandomStream random(7, 0);
  std::uint64_t id = 0;
  const auto put = [&](Vec3d cells) {
    if (static_cast<int>(id) % comm.size() == comm.rank()) {
      const auto [a, b] = random.uniform(id, 0);
      const auto [c, unused] = random.uniform(id, 1);
      static_cast<void>(unused);
      p.id.push_back(id);
      p.position.push_back(kCell * cells);
      p.velocity.push_back({20.0 * (a - 0.5), 20.0 * (b - 0.5), 20.0 * (c - 0.5)});
      p.mass.push_back(kMass);
      p.body.push_back(0);
      p.material.push_back(0);
      p.damage.push_back(1.0);
    }
    ++id;
  };
  for (int x = 0; x < 2 * kEdge; ++x) {
    for (int y = 0; y < 2 * kEdge; ++y) {
      for (int z = 0; z < 2 * kEdge; ++z) put(Vec3d{0.5 * x - 0.25, 0.5 * y - 0.25, 0.5 * z - 0.25});
    }
  }
  for (int n = 0; n < far; ++n) {
    put(Vec3d{100.0 + 40.0 * n, 0.0, 0.0});
    put(Vec3d{101.0 + 40.0 * n, 0.0, 0.0});
  }
  return p;
}

std::unique_ptr<Engine> engine_with(Precision precision, int far, const mpi::Comm& comm) {
  EngineSetup setup;
  setup.cell = kCell;
  setup.materials.resize(1);
  setup.effects = {.damage = false, .fully_damaged = true};
  setup.numerics.precision = precision;
  auto engine = make_host_engine(setup, comm);
  const ParticleArrays p = cube_and_pairs(far, comm);
  material::FlawLists none;
  none.first.assign(p.size() + 1, 0U);
  const Vec3d no_spin[1] = {};
  engine->insert(p, none, no_spin);
  return engine;
}

// Two stretches between sortings, up to a scatter.
void two_cycles(Engine& engine) {
  engine.scatter(0.5 * kStep);
  for (int n = 1; n <= 6; ++n) {
    engine.update_grid(kStep);
    if (n % 3 == 0) {
      engine.gather(kStep);
      engine.sort();
      engine.scatter(0.5 * kStep);
    } else {
      engine.gather_scatter(kStep);
    }
  }
}

class EngineMemory : public testing::TestWithParam<Precision> {};

// Positions and velocities of the cube are those of an engine that keeps all its arrays, because the pairs far away
// make its nodes many: to the last bit.
TEST_P(EngineMemory, GivenBackBetweenUsesChangesNothing) {
  const mpi::Comm comm;
  if (comm.size() > 1) GTEST_SKIP() << "slabs would differ";
  const auto sparing = engine_with(GetParam(), 0, comm);
  const auto keeping = engine_with(GetParam(), 200, comm);
  two_cycles(*sparing);
  two_cycles(*keeping);
  // One holds the velocities of its nodes after a scatter, the other does not.
  EXPECT_LT(2 * sparing->stats().grid_bytes, keeping->stats().grid_bytes);
  sparing->update_grid(kStep);
  keeping->update_grid(kStep);
  const ParticleOutput expected = keeping->observe();
  const ParticleOutput got = sparing->observe();
  std::map<std::uint64_t, std::size_t> place;
  for (std::size_t i = 0; i < expected.size(); ++i) place[expected.id[i]] = i;
  ASSERT_EQ(got.size(), std::size_t{8} * kEdge * kEdge * kEdge);
  std::size_t differ = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    const std::size_t k = place.at(got.id[i]);
    const Vec3d moved = got.position[i] - expected.position[k];
    const Vec3d kicked = got.velocity[i] - expected.velocity[k];
    const bool same = dot(moved, moved) + dot(kicked, kicked) == 0.0 && got.pressure[i] == expected.pressure[k];
    differ += same ? 0 : 1;
  }
  EXPECT_EQ(differ, 0U);
}

// Momentum stays to rounding: no sum, velocity or gradient is lost where arrays come and go, on any number of ranks.
TEST_P(EngineMemory, MomentumStays) {
  const mpi::Comm comm;
  const ParticleArrays before = cube_and_pairs(0, comm);
  const auto engine = engine_with(GetParam(), 0, comm);
  two_cycles(*engine);
  const ParticleOutput after = engine->inspect();
  const auto momentum = [&](const ParticleArrays& p, double& scale) {
    Vec3d sum{};
    for (std::size_t i = 0; i < p.size(); ++i) {
      sum = sum + p.mass[i] * p.velocity[i];
      scale += p.mass[i] * std::sqrt(dot(p.velocity[i], p.velocity[i]));
    }
    return sum;
  };
  double scale = 0.0, unused = 0.0;
  const Vec3d change = momentum(after, unused) - momentum(before, scale);
  // Rounding of 1e5 particles in six steps; none of it has a direction.
  const double tolerance = GetParam() == Precision::kMixed ? 1e-7 : 1e-14;
  scale = comm.sum(scale);
  EXPECT_LT(std::abs(comm.sum(change.x)), tolerance * scale);
  EXPECT_LT(std::abs(comm.sum(change.y)), tolerance * scale);
  EXPECT_LT(std::abs(comm.sum(change.z)), tolerance * scale);
}

// At 8 particles per cell a broken particle in mixed precision takes no more than 130 bytes at any time, grid and
// sorting included: its fields, of which the velocity gradient (36 bytes) is held around a sorting only, its share of
// the nodes (32 bytes each and an eighth of a node, twice that with the nodes around so small a cube), and what sorting
// needs.
TEST_P(EngineMemory, OfBrokenRockIsBounded) {
  const mpi::Comm comm;
  const auto engine = engine_with(GetParam(), 0, comm);
  two_cycles(*engine);
  const EngineStats s = engine->stats();
  const auto particles = static_cast<double>(comm.sum(s.particles));
  const double held = static_cast<double>(comm.sum(s.particle_bytes)) / particles;
  const double nodes = static_cast<double>(comm.sum(s.grid_bytes)) / particles;
  const double sorting = static_cast<double>(comm.sum(s.sort_bytes)) / particles;
  const bool mixed = GetParam() == Precision::kMixed;
  const GroupSet groups{.elastic = true, .energy = true};
  const auto fields = static_cast<double>(mixed ? ParticleStore<MixedPrecision>::bytes_per_particle(groups)
                                                : ParticleStore<DoublePrecision>::bytes_per_particle(groups));
  const double gradient = 9.0 * (mixed ? 4.0 : 8.0);
  EXPECT_GE(held, fields - gradient);
  EXPECT_LT(held, 1.05 * (fields - gradient));  // a tile's last pack is not full
  EXPECT_GE(sorting, gradient);
  if (mixed && comm.size() == 1) {
    EXPECT_LE(held + nodes + sorting, 130.0);
  }
}

// What sorting holds beside everything else shows in the figures: where each particle goes, a word of 4 bytes, the
// first slots of the cells (here a third of a word), and packs set aside while they are rearranged.
TEST_P(EngineMemory, OfSortingIsCounted) {
  const mpi::Comm comm;
  const auto engine = engine_with(GetParam(), 200, comm);
  two_cycles(*engine);
  const EngineStats s = engine->stats();
  const double sorting = static_cast<double>(comm.sum(s.sort_bytes)) / static_cast<double>(comm.sum(s.particles));
  EXPECT_GE(sorting, 4.0);
  // Particles that came from another rank make it the copy of a group instead of some packs.
  if (comm.size() == 1) {
    EXPECT_LE(sorting, GetParam() == Precision::kMixed ? 12.0 : 20.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Precisions, EngineMemory, testing::Values(Precision::kMixed, Precision::kDouble));

}  // namespace
}  // namespace breccia::grid

// Runs compared particle by particle, whatever ranks hold them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <set>
#include <vector>

#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {

// What is compared of a particle, and where it was.
struct Sample {
  std::uint64_t id;
  Vec3d position, velocity;
  double damage, density, pressure, energy;
  int rank;
};
using State = std::vector<Sample>;  // all particles of all ranks in the order of their ids

inline State gather(const ParticleOutput& p, const mpi::Comm& comm) {
  State mine;
  for (std::size_t i = 0; i < p.size(); ++i) {
    mine.push_back({p.id[i], p.position[i], p.velocity[i], p.damage[i], p.density[i], p.pressure[i],
                    p.internal_energy[i], comm.rank()});
  }
  State all = comm.allgather_arrays(std::span<const Sample>(mine));
  std::sort(all.begin(), all.end(), [](const Sample& a, const Sample& b) { return a.id < b.id; });
  return all;
}

/// States of all particles, every 20 steps for 200; the same on all ranks. `visit` sees each t_n besides.
inline std::vector<State> history(
    const Scene& scene, const mpi::Comm& comm,
    const std::function<void(const TimeLoop&)>& visit = [](const TimeLoop&) {}) {
  constexpr std::uint64_t kSteps = 200, kEvery = 20;
  std::vector<State> states;
  simulate(
      scene,
      [&](const TimeLoop& loop) {
        visit(loop);
        if (loop.step() % kEvery == 0) states.push_back(gather(loop.engine().observe(), comm));
        return loop.step() < kSteps;
      },
      comm);
  return states;
}

inline double length(Vec3d v) { return std::sqrt(dot(v, v)); }

// Lengths and speeds of a scene.
struct Scale {
  double size;          // [m]
  double speed;         // [m/s]
  double period = 0.0;  // of a periodic axis [m]
  int axis = 0;         // that is periodic
};

// The sums of a node are the same but for their order where slabs meet: 1e-16 of the values per step. 200 steps with
// contact and yielding may amplify that a little, to 1e-12 of the scene's scales; a message that is lost, doubled or
// late shows as 1e-6 and more.
inline void expect_equal(const State& many, const State& one, const Scale& scale, double tolerance = 1e-12) {
  constexpr double kBulkModulus = 2.67e10, kDensity = 2700.0;
  ASSERT_EQ(many.size(), one.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    ASSERT_EQ(many[i].id, one[i].id);
    Vec3d moved = many[i].position - one[i].position;
    double& along = scale.axis == 0 ? moved.x : scale.axis == 1 ? moved.y : moved.z;
    if (scale.period > 0.0) along -= scale.period * std::round(along / scale.period);
    ASSERT_LE(length(moved), tolerance * scale.size) << "particle " << i;
    ASSERT_LE(length(many[i].velocity - one[i].velocity), tolerance * scale.speed) << "particle " << i;
    ASSERT_NEAR(many[i].damage, one[i].damage, tolerance) << "particle " << i;
    ASSERT_NEAR(many[i].density, one[i].density, tolerance * kDensity) << "particle " << i;
    ASSERT_NEAR(many[i].pressure, one[i].pressure, tolerance * kBulkModulus) << "particle " << i;
    ASSERT_NEAR(many[i].energy, one[i].energy, tolerance * scale.speed * scale.speed) << "particle " << i;
  }
}

// What the ranks had to do in a run: no case may pass for want of work.
struct Work {
  int busy_ranks = 0;         // that held particles at the start
  std::size_t migrated = 0;   // times that a particle was on another rank than in the state before
  bool was_breaking = false;  // some state had a damaged fraction between 5 and 95 %
};

inline Work work_of(const std::vector<State>& states) {
  Work work;
  std::set<int> ranks;
  for (const Sample& s : states.front()) ranks.insert(s.rank);
  work.busy_ranks = static_cast<int>(ranks.size());
  for (std::size_t n = 1; n < states.size(); ++n) {
    for (std::size_t i = 0; i < states[n].size(); ++i) {
      if (states[n][i].rank != states[n - 1][i].rank) ++work.migrated;
    }
  }
  for (const State& state : states) {
    double damage = 0.0;
    for (const Sample& s : state) damage += s.damage / static_cast<double>(state.size());
    work.was_breaking = work.was_breaking || (damage > 0.05 && damage < 0.95);
  }
  return work;
}

}  // namespace breccia::sim::test

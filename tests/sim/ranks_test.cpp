// The same run on any number of ranks: compared, particle by particle, with one rank (physics.md 8, case 17).
#include <gtest/gtest.h>

#include "tests/sim/collision.hpp"

namespace breccia::sim::test {
namespace {

// What is compared of a particle.
struct Sample {
  std::uint64_t id;
  Vec3d position, velocity;
  double damage, density;
};

std::vector<Sample> samples(const ParticleOutput& p, const mpi::Comm& comm) {
  std::vector<Sample> mine;
  for (std::size_t i = 0; i < p.size(); ++i) {
    mine.push_back({p.id[i], p.position[i], p.velocity[i], p.damage[i], p.density[i]});
  }
  std::vector<Sample> all = comm.allgather_arrays(std::span<const Sample>(mine));
  std::sort(all.begin(), all.end(), [](const Sample& a, const Sample& b) { return a.id < b.id; });
  return all;
}

double length(Vec3d v) { return std::sqrt(dot(v, v)); }

struct Differences {
  double position = 0.0, velocity = 0.0, damage = 0.0, density = 0.0;
};

// Largest differences after `steps` between all ranks together and one alone; `period`: of a periodic x axis.
Differences against_one_rank(const Scene& scene, std::uint64_t steps, double period = 0.0) {
  const std::vector<Sample> many = samples(state_after(steps, scene, mpi::Comm()), mpi::Comm());
  const mpi::Comm self(MPI_COMM_SELF);
  const std::vector<Sample> one = samples(state_after(steps, scene, self), self);
  Differences worst;
  EXPECT_EQ(many.size(), one.size());
  if (many.size() != one.size()) return worst;
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(many[i].id, one[i].id);
    Vec3d moved = many[i].position - one[i].position;
    if (period > 0.0) moved.x -= period * std::round(moved.x / period);
    worst.position = std::max(worst.position, length(moved));
    worst.velocity = std::max(worst.velocity, length(many[i].velocity - one[i].velocity));
    worst.damage = std::max(worst.damage, std::abs(many[i].damage - one[i].damage));
    worst.density = std::max(worst.density, std::abs(many[i].density - one[i].density));
  }
  std::printf("rank %d: %g %g %g %g\n", mpi::Comm().rank(), worst.position, worst.velocity, worst.damage, worst.density);
  return worst;
}

TEST(Ranks, Collision) {
  const Scene scene = load(collision(9e3));
  const Differences d = against_one_rank(scene, 200);
  EXPECT_LT(d.position, 1e-12 * 200e3);
}

TEST(Ranks, FewerSlabsThanRanks) {
  const Scene scene = load(collision(25e3));
  const Differences d = against_one_rank(scene, 200);
  EXPECT_LT(d.position, 1e-12 * 200e3);
}

}  // namespace
}  // namespace breccia::sim::test

// The same run with any number of threads of a rank, bit for bit and in the same order in memory.
#include <gtest/gtest.h>

#include <cstring>

#include "tests/sim/collision.hpp"

namespace breccia::sim::test {
namespace {

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

class Threads : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] Scene load_scene(const std::string& text) const {
    return load(text, {std::string("numerics.precision=") + GetParam()});
  }
  // After 100 steps: damage, contact, several sortings and gravity windows.
  void expect_same(const std::string& text, std::uint64_t steps = 100) const {
    const Scene scene = load_scene(text);
    const mpi::Comm world;
    const ParticleOutput one = state_after(steps, scene, world);
    for (const int threads : {2, 3, 8}) {
      const ParticleOutput many = state_after(steps, scene, world, threads);
      EXPECT_TRUE(same_bits(many.id, one.id));
      EXPECT_TRUE(same_bits(many.position, one.position));
      EXPECT_TRUE(same_bits(many.velocity, one.velocity));
      EXPECT_TRUE(same_bits(many.damage, one.damage));
      EXPECT_TRUE(same_bits(many.density, one.density));
      EXPECT_TRUE(same_bits(many.pressure, one.pressure));
      EXPECT_TRUE(same_bits(many.internal_energy, one.internal_energy));
    }
  }
};

TEST_P(Threads, GiveTheSameCollision) { expect_same(collision(9e3)); }
TEST_P(Threads, GiveTheSameOfDebris) { expect_same(debris()); }
TEST_P(Threads, GiveTheSameOfWhatLeavesItsSlab) { expect_same(flying_body("8 km")); }
TEST_P(Threads, GiveTheSameOnAPeriodicAxis) {
  for (const int blocks : {1, 3, 4}) expect_same(periodic_slide(blocks));
  for (const int blocks : {1, 5}) expect_same(periodic_slide(blocks, 2));
}
// Where nodes come from memory they are asked for ahead (grid/nodes_ahead.hpp; what is asked for: grid_nodes_ahead).
TEST_P(Threads, GiveTheSameWhereNodesOutgrowTheCache) {
  const auto begun = [](const TimeLoop& loop) {
    EXPECT_GT(loop.engine().stats().grid_bytes, 64U << 20);  // as HostEngine::outgrows_cache
    return false;
  };
  simulate(load_scene(many_nodes()), begun, mpi::Comm());
  expect_same(many_nodes(), 4);
}

INSTANTIATE_TEST_SUITE_P(Precisions, Threads, testing::Values("mixed", "double"));

}  // namespace
}  // namespace breccia::sim::test

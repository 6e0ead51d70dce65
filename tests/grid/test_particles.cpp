// Particles rearranged in place are those that a copy would give.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

#include "grid/particles.hpp"

namespace breccia::grid {
namespace {

constexpr GroupSet kAllGroups{.elastic = true, .energy = true, .damage_level = true, .flaws = true, .gravity = true};

template <class P>
class Particles : public testing::Test {
 protected:
  static constexpr std::size_t kLanes = P::kLanes;
  using Records = std::vector<std::vector<std::byte>>;

  // Every slot holds bytes of its own in all fields.
  static ParticleStore<P> filled(std::size_t packs) {
    ParticleStore<P> store(kAllGroups);
    store.allocate(packs);
    std::mt19937 random(7);
    std::vector<std::byte> record(store.record_bytes());
    for (std::size_t slot = 0; slot < packs * kLanes; ++slot) {
      for (std::byte& b : record) b = static_cast<std::byte>(random());
      store.write_record(slot, record.data());
    }
    return store;
  }

  static Records records(ParticleStore<P>& store) {
    Records all(store.packs() * kLanes, std::vector<std::byte>(store.record_bytes()));
    for (std::size_t slot = 0; slot < all.size(); ++slot) store.read_record(slot, all[slot].data());
    return all;
  }

  static void expect_rearranged(std::size_t packs, const std::vector<std::uint32_t>& source) {
    for (const int threads : {1, 2, 3}) {
      ParticleStore<P> store = filled(packs);
      const Records before = records(store);
      store.gather(source, threads);
      const Records after = records(store);
      ASSERT_EQ(after.size(), source.size());
      const std::vector<std::byte> nothing(store.record_bytes());
      for (std::size_t slot = 0; slot < source.size(); ++slot) {
        const bool empty = source[slot] == ParticleStore<P>::kEmpty;
        ASSERT_EQ(after[slot], empty ? nothing : before[source[slot]]) << "slot " << slot << ", " << threads;
      }
    }
  }
};

using Precisions = testing::Types<MixedPrecision, DoublePrecision>;
TYPED_TEST_SUITE(Particles, Precisions);

// What a state of the flaws says comes back whole, the largest numbers included.
TEST(FlawStates, SurviveTheirWord) {
  for (const FlawState s : {FlawState{0, 1, 0}, FlawState{254, 255, 0xfffe}, FlawState{255, 255, 0xffff}}) {
    const FlawState back = FlawState::of(s.packed());
    EXPECT_EQ(back.active, s.active);
    EXPECT_EQ(back.all, s.all);
    EXPECT_EQ(back.next, s.next);
  }
}

// Groups that nobody needs any more leave no memory behind.
TYPED_TEST(Particles, GiveMemoryBack) {
  using P = TypeParam;
  ParticleStore<P> store = this->filled(50);
  store.drop_damage();
  EXPECT_EQ(store.flaws.capacity() + store.damage_level.capacity(), 0U);
  const std::size_t with_gradients = store.bytes();
  store.drop_gradients();
  EXPECT_EQ(store.affine.capacity(), 0U);
  EXPECT_EQ(store.bytes(), with_gradients - 50 * sizeof(Affine<P>));
  store.hold_gradients();
  EXPECT_EQ(store.bytes(), with_gradients);
}

// At 8 per cell the nodes are 16 bytes a particle and 13 flaws 26 more: together at most 200 while damage grows.
TEST(ParticleBytes, LeaveRoomForGridAndFlaws) {
  GroupSet groups = kAllGroups;
  groups.gravity = false;
  EXPECT_LE(ParticleStore<MixedPrecision>::bytes_per_particle(groups), 156U);
}

// Particles of a plane change places with those of the next one, with gaps at the ends of tiles: more packs than
// before.
TYPED_TEST(Particles, NeighboursChangePlaces) {
  constexpr std::size_t kPacks = 40;
  constexpr std::size_t kTile = 3 * TestFixture::kLanes - 1;
  std::vector<std::uint32_t> order(kPacks * TestFixture::kLanes);
  for (std::uint32_t n = 0; n < order.size(); ++n) order[n] = n;
  std::mt19937 random(3);
  for (std::size_t first = 0; first + 60 <= order.size(); first += 30) {
    std::shuffle(order.begin() + static_cast<std::ptrdiff_t>(first),
                 order.begin() + static_cast<std::ptrdiff_t>(first + 60), random);
  }
  std::vector<std::uint32_t> source;
  for (std::size_t n = 0; n < order.size(); ++n) {
    source.push_back(order[n]);
    if (n % kTile == kTile - 1) source.push_back(ParticleStore<TypeParam>::kEmpty);
  }
  while (source.size() % TestFixture::kLanes != 0) source.push_back(ParticleStore<TypeParam>::kEmpty);
  TestFixture::expect_rearranged(kPacks, source);
}

// As at the start, and after particles of other ranks were appended and own ones have left: fewer packs than before.
TYPED_TEST(Particles, AnyOrder) {
  constexpr std::size_t kPacks = 23;
  std::vector<std::uint32_t> source(kPacks * TestFixture::kLanes);
  for (std::uint32_t n = 0; n < source.size(); ++n) source[n] = n;
  std::shuffle(source.begin(), source.end(), std::mt19937(5));
  TestFixture::expect_rearranged(kPacks, source);
  source.resize(5 * TestFixture::kLanes);
  TestFixture::expect_rearranged(kPacks, source);
  TestFixture::expect_rearranged(kPacks, {});
}

}  // namespace
}  // namespace breccia::grid

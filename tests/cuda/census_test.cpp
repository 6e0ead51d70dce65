// Blocks of space counted by the device, on one rank and several: the choice of boxes is the host's to the bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "cuda/device_census.hpp"
#include "cuda/stream.hpp"
#include "gravity/mesh/host_census.hpp"
#include "gravity/mesh/layout.hpp"
#include "tests/cuda/gravity_cases.hpp"

namespace breccia::cuda {
namespace {

using gravity::BlockCount;
using gravity::BlockIndex;
using gravity::HostCensus;

struct Cloud {
  std::vector<Vec3d> position;
  std::vector<double> mass;

  [[nodiscard]] gravity::ParticlesView view() const { return {position, mass}; }
};

Cloud cloud_of(const Scene& scene, const mpi::Comm& comm) {
  const ParticleArrays particles = scene::make_particles(scene, comm);
  return {particles.position, particles.mass};
}

// Uniform in a ball, masses between 1 and 2 [kg].
void add_ball(Cloud& cloud, std::size_t count, Vec3d centre, double radius, std::mt19937_64& random) {
  std::uniform_real_distribution<double> side(-1.0, 1.0);
  for (std::size_t n = 0; n < count;) {
    const Vec3d p{side(random), side(random), side(random)};
    if (dot(p, p) > 1.0) continue;
    cloud.position.push_back(centre + radius * p);
    cloud.mass.push_back(1.5 + 0.5 * side(random));
    ++n;
  }
}

// Dense bodies, one on each side of the origin, a contact of two, and debris in a block each, some of it very far away.
Cloud random_cloud(unsigned seed) {
  std::mt19937_64 random(seed);
  Cloud cloud;
  add_ball(cloud, 1500, {-3e6, 1e5, 0}, 5e4, random);
  add_ball(cloud, 1000, {2e6, 0, -1e6}, 4.37e4, random);
  add_ball(cloud, 500, {2.075e6, 0, -1e6}, 3.47e4, random);
  add_ball(cloud, 700, {0, 0, 0}, 3e7, random);
  add_ball(cloud, 5, {0, 0, 0}, 1e15, random);
  std::vector<std::size_t> order(cloud.position.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), random);
  Cloud mixed;
  for (const std::size_t i : order) {
    mixed.position.push_back(cloud.position[i]);
    mixed.mass.push_back(cloud.mass[i]);
  }
  return mixed;
}

// In stretches of unlike lengths; the last of several ranks gets none.
Cloud share_of(const Cloud& all, const mpi::Comm& comm) {
  if (comm.size() == 1) return all;
  const auto holders = static_cast<std::size_t>(comm.size() - 1);
  Cloud mine;
  for (std::size_t i = 0; i < all.position.size(); ++i) {
    if (std::min(i / 2000, holders - 1) != static_cast<std::size_t>(comm.rank())) continue;
    mine.position.push_back(all.position[i]);
    mine.mass.push_back(all.mass[i]);
  }
  return mine;
}

class OnDevice {
 public:
  explicit OnDevice(const Cloud& cloud) : census(stream_) {
    const std::size_t n = cloud.mass.size();
    std::vector<double> values;
    for (const Vec3d p : cloud.position) values.push_back(p.x);
    for (const Vec3d p : cloud.position) values.push_back(p.y);
    for (const Vec3d p : cloud.position) values.push_back(p.z);
    values.insert(values.end(), cloud.mass.begin(), cloud.mass.end());
    bodies_.reserve(4 * n);
    bodies_.upload(values, stream_);
    const double* x = bodies_.data();
    double heaviest = 0.0;
    for (const double m : cloud.mass) heaviest = std::max(heaviest, m);
    census.take({{x, x + n, x + 2 * n}, x + 3 * n, static_cast<unsigned>(n)}, heaviest);
  }

 private:
  const Stream stream_;
  DeviceArray<double> bodies_;

 public:
  DeviceCensus census;
};

void expect_same(const gravity::Box& a, const gravity::Box& b) {
  EXPECT_TRUE(a.low.x == b.low.x && a.low.y == b.low.y && a.low.z == b.low.z && a.high.x == b.high.x &&
              a.high.y == b.high.y && a.high.z == b.high.z);
}

// Masses in quanta of 1e-13 of the heaviest and less, and added by the host in another order.
constexpr double kMassRounding = 1e-12;

template <class T>
std::vector<T> sorted(std::span<const T> blocks) {
  std::vector<T> by_index(blocks.begin(), blocks.end());
  std::sort(by_index.begin(), by_index.end(), [](const T& a, const T& b) { return a.index < b.index; });
  return by_index;
}

void expect_same(std::span<const BlockCount> found, std::span<const BlockCount> expected) {
  const std::vector<BlockCount> a = sorted(found);
  const std::vector<BlockCount> b = sorted(expected);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_TRUE(a[i].index == b[i].index);
    EXPECT_EQ(a[i].particles, b[i].particles);
  }
}

class CensusOrder : public testing::TestWithParam<Order> {
 protected:
  void SetUp() override { cuda_emulation::set_order(GetParam(), 7); }
  const mpi::Comm world_;
};

// Every answer, of blocks that hold one particle or hundreds, at coordinates of either sign and beyond the last block.
TEST_P(CensusOrder, AnswersAreTheHosts) {
  const Cloud cloud = share_of(random_cloud(3), world_);
  OnDevice device(cloud);
  HostCensus host(cloud.view(), 1);
  EXPECT_EQ(device.census.particles(), host.particles());
  if (!cloud.mass.empty()) expect_same(device.census.bounds(), host.bounds());
  expect_same(device.census.occupied(3e5), host.occupied(3e5));
  for (const double width : {2e4, 1e-2}) {
    device.census.divide(width);
    host.divide(width);
    EXPECT_NEAR(device.census.mass(), host.mass(), kMassRounding * host.mass());
    const std::vector<BlockCount> dense = device.census.crowded(20);
    expect_same(dense, host.crowded(20));
    std::vector<BlockIndex> asked{{12345, 6, 7}};
    for (const BlockCount& b : dense) asked.push_back({b.index.x, b.index.y + 1, b.index.z});
    EXPECT_EQ(device.census.counts(asked), host.counts(asked));
    const std::vector<gravity::Block> found = sorted(device.census.around(asked));
    const std::vector<gravity::Block> expected = sorted(host.around(asked));
    std::size_t place = 0;
    for (const gravity::Block& b : expected) {
      const bool next = std::any_of(asked.begin(), asked.end(), [&](BlockIndex a) {
        return std::abs(a.x - b.index.x) <= 1 && std::abs(a.y - b.index.y) <= 1 && std::abs(a.z - b.index.z) <= 1;
      });
      if (!next) continue;  // the host counts some more
      ASSERT_LT(place, found.size());
      const gravity::Block& block = found[place++];
      EXPECT_TRUE(block.index == b.index);
      EXPECT_EQ(block.count, b.count);
      EXPECT_NEAR(block.mass, b.mass, kMassRounding * b.mass);
      expect_same(block.bounds, b.bounds);
    }
    EXPECT_EQ(found.size(), place);
  }
}

void expect_same_layout(const Cloud& cloud, const gravity::MeshParameters& mesh, std::size_t boxes,
                        const mpi::Comm& comm) {
  OnDevice device(cloud);
  const gravity::Layout found = gravity::lay_boxes(device.census, mesh, comm);
  const gravity::Layout expected = gravity::lay_boxes(cloud.view(), mesh, comm, 1);
  EXPECT_EQ(expected.boxes.size(), boxes);
  EXPECT_EQ(found.spacing, expected.spacing);
  EXPECT_EQ(found.cell, expected.cell);
  ASSERT_EQ(found.boxes.size(), expected.boxes.size());
  for (std::size_t k = 0; k < found.boxes.size(); ++k) expect_same(found.boxes[k], expected.boxes[k]);
  EXPECT_EQ(found.count, expected.count);
  ASSERT_EQ(found.mass.size(), expected.mass.size());
  for (std::size_t k = 0; k < found.mass.size(); ++k) {
    EXPECT_NEAR(found.mass[k], expected.mass[k], kMassRounding * expected.mass[k]);
  }
}

class CensusTest : public testing::Test {
 protected:
  void SetUp() override { cuda_emulation::set_order(Order::kRandom, 7); }
  const mpi::Comm world_;
};

TEST_F(CensusTest, BoxesAreTheHosts) {
  const Cloud cloud = share_of(random_cloud(1), world_);
  expect_same_layout(cloud, {}, 2, world_);
  expect_same_layout(cloud, {.particle_spacing = 7e3}, 2, world_);
  expect_same_layout(cloud, {.particle_spacing = 1e3}, 0, world_);  // nothing is dense at that
  expect_same_layout({}, {}, 0, world_);
}

// Lattices whose planes may lie on the borders of blocks: two bodies in contact, with debris around, far from each
// other.
TEST_F(CensusTest, BoxesOfScenesAreTheHosts) {
  expect_same_layout(cloud_of(bodies(Precision::kMixed), world_), {}, 1, world_);
  expect_same_layout(cloud_of(crowd(Precision::kMixed), world_), {}, 1, world_);
  expect_same_layout(cloud_of(two_crowds(Precision::kMixed), world_), {}, 2, world_);
}

// What comes to the host are blocks, not particles: no more of them where there is ten times the debris.
TEST_F(CensusTest, DebrisStaysOnTheDevice) {
  const mpi::Comm alone = self();
  std::vector<std::uint64_t> bytes, waits;
  for (const std::size_t debris : {300UL, 3000UL}) {
    std::mt19937_64 random(5);
    Cloud cloud;
    add_ball(cloud, 1500, {0, 0, 0}, 5e4, random);
    add_ball(cloud, debris, {0, 0, 0}, 1e9, random);
    OnDevice device(cloud);
    const std::uint64_t bytes_before = cuda_emulation::bytes_to_host();
    const std::uint64_t waits_before = cuda_emulation::synchronisation_count();
    EXPECT_EQ(gravity::lay_boxes(device.census, {.particle_spacing = 7e3}, alone).boxes.size(), 1U);
    bytes.push_back(cuda_emulation::bytes_to_host() - bytes_before);
    waits.push_back(cuda_emulation::synchronisation_count() - waits_before);
  }
  // A ball four blocks wide and what is next to it: up to 6^3 blocks of 72 bytes, 4^3 of 16.
  EXPECT_GT(bytes[0], 4096U);
  EXPECT_LT(bytes[0], 17'000U);
  EXPECT_EQ(bytes[1], bytes[0]);
  EXPECT_LE(waits[0], 9U);
  EXPECT_EQ(waits[1], waits[0]);
}

INSTANTIATE_TEST_SUITE_P(Orders, CensusOrder, testing::Values(Order::kForward, Order::kReverse, Order::kRandom),
                         [](const auto& p) {
                           return p.param == Order::kForward   ? "forward"
                                  : p.param == Order::kReverse ? "reverse"
                                                               : "random";
                         });

}  // namespace
}  // namespace breccia::cuda

// The parts of the particle mesh, each against what it must be exactly.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "breccia/error.hpp"
#include "gravity/mesh/block_sieve.hpp"
#include "gravity/mesh/box_mesh.hpp"
#include "gravity/mesh/boxes.hpp"
#include "gravity/mesh/clusters.hpp"
#include "gravity/mesh/convolution.hpp"
#include "gravity/mesh/host_census.hpp"
#include "gravity/mesh/split.hpp"
#include "plain_sum.hpp"

namespace breccia::gravity {
namespace {

TEST(FftPlan, TransformsASineToItsWaveNumberAndBack) {
  constexpr int kLength = 60;
  constexpr int kWave = 7;
  AlignedVector<std::complex<double>> row(kLength / 2 + 1);
  auto* real = reinterpret_cast<double*>(row.data());
  for (int k = 0; k < kLength; ++k) real[k] = std::sin(2.0 * kPi * kWave * k / kLength);
  FftPlan<double>(FftKind::kRealToComplex, kLength, 1, 1, kLength / 2 + 1)(row.data());
  for (int k = 0; k <= kLength / 2; ++k) {
    EXPECT_NEAR(row[static_cast<std::size_t>(k)].imag(), k == kWave ? -0.5 * kLength : 0.0, 1e-12);
  }
  FftPlan<double>(FftKind::kComplexToReal, kLength, 1, 1, kLength / 2 + 1)(row.data());
  for (int k = 0; k < kLength; ++k) EXPECT_NEAR(real[k] / kLength, std::sin(2.0 * kPi * kWave * k / kLength), 1e-14);
}

TEST(FftPlan, LengthsHaveSmallFactors) {
  EXPECT_EQ(fft_friendly_length(1), 2);
  EXPECT_EQ(fft_friendly_length(121), 126);
  EXPECT_EQ(fft_friendly_length(211), 216);
}

// The split is exact: what the mesh should give and what pairs add is Plummer's law, for any softening.
TEST(GaussianSplit, PartsAddUpToTheWholeLaw) {
  for (const double softening : {0.0, 0.06, 1.5}) {
    for (const double cutoff : {4.5, 5.5, 7.0}) {
      const GaussianSplit split{0.8, 0.8 * cutoff, softening};
      const ShortRange<double> law = fit_short_range<double>(split);
      for (double r = 0.02; r * r + softening * softening < split.cutoff * split.cutoff; r *= 1.1) {
        const double rho2 = r * r + softening * softening;
        const double q = 1.0 / std::sqrt(rho2);
        // The long-range force from its potential, by a difference good to 1e-9.
        const double step = 1e-3;
        const double slope = (8.0 * (long_range_potential(split, r + step) - long_range_potential(split, r - step)) -
                              (long_range_potential(split, r + 2 * step) - long_range_potential(split, r - 2 * step))) /
                             (12.0 * step);
        const auto pair = [&](auto degree) {
          const ShortRangePair<decltype(degree)::value, double, double> p(law);
          return std::pair(p.force(rho2, q) * r, p.potential(rho2, q));
        };
        const auto [force, potential] = law.degree == 8    ? pair(std::integral_constant<int, 8>{})
                                        : law.degree == 10 ? pair(std::integral_constant<int, 10>{})
                                                           : pair(std::integral_constant<int, 12>{});
        // The fit is allowed 2e-5 of the unsoftened force of the pair.
        EXPECT_NEAR(force + slope, r * q * q * q, 2.1e-5 * q * q);
        EXPECT_NEAR(potential - long_range_potential(split, r), q, 1e-4 * q);
      }
    }
  }
  EXPECT_THROW(fit_short_range<float>({0.8, 0.8 * 12.0, 0.0}), UsageError);
}

// A Gaussian average over the neighbourhood, here along one axis at a time, of the narrower potential is the potential.
TEST(GaussianSplit, NarrowerPotentialSmearsToTheWholeOne) {
  constexpr double kSmearing = 0.25;
  for (const double softening : {0.0, 0.1, 0.4, 1.2}) {
    const GaussianSplit split{0.8, 3.6, softening};
    for (const double r : {0.0, 0.7, 2.0, 5.0}) {
      // exp(-k^2/4) is the density exp(-x^2)/sqrt(pi) on each axis; by the trapezoidal rule, exact for Gaussians.
      double sum = 0.0;
      const double step = 0.4;
      for (int i = -14; i <= 14; ++i) {
        for (int j = -14; j <= 14; ++j) {
          for (int k = -14; k <= 14; ++k) {
            const double x = step * i;
            const double y = step * j;
            const double z = step * k;
            const double weight = std::exp(-(x * x + y * y + z * z)) * std::pow(step / std::sqrt(kPi), 3);
            sum += weight * unsmeared_long_range_potential(split, kSmearing, std::hypot(r - x, y, z));
          }
        }
      }
      EXPECT_NEAR(sum, long_range_potential(split, r), 1e-8) << softening << " " << r;
    }
  }
}

// With vacuum around it a point mass has the kernel itself as its potential, out to the far corner.
TEST(Convolution, PointMassesInVacuum) {
  const mpi::Comm comm;
  const MeshSize size{{25, 30, 24}, {48, 56, 42}};
  const auto kernel = [](int x, int y, int z) { return -1.0 / std::sqrt(0.5 + x * x + y * y + z * z); };
  Convolution<double> convolution(size, kernel, comm, 2);
  const PlaneRange own = convolution.planes();
  const int masses[2][3] = {{3, 3, 3}, {21, 20, 11}};
  std::vector<double> values(static_cast<std::size_t>(own.count() * size.nodes[1] * size.nodes[2]), 0.0);
  const auto at = [&](int x, int y, int z) -> double& {
    return values[static_cast<std::size_t>(((x - own.begin) * size.nodes[1] + y) * size.nodes[2] + z)];
  };
  for (const auto& m : masses) {
    if (m[0] >= own.begin && m[0] < own.end) at(m[0], m[1], m[2]) = 2.0;
  }
  convolution.apply(values.data());
  double worst = 0.0;
  for (int x = own.begin; x < own.end; ++x) {
    for (int y = 0; y < size.nodes[1]; ++y) {
      for (int z = 0; z < size.nodes[2]; ++z) {
        double expected = 0.0;
        for (const auto& m : masses) {
          expected += 2.0 * kernel(std::abs(x - m[0]), std::abs(y - m[1]), std::abs(z - m[2]));
        }
        worst = std::max(worst, std::abs(at(x, y, z) - expected));
      }
    }
  }
  // Roundings of a transform of 1e5 points.
  EXPECT_LT(comm.max(worst), 1e-13);
}

TEST(Clusters, HoldEveryParticleOnceAtItsPlace) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(4.0, 60.0);
  std::vector<Vec3d> position;
  std::vector<double> mass;
  for (int i = 0; i < 5000; ++i) {
    position.push_back({unit(random), unit(random), i % 7 == 0 ? 4.0 : unit(random)});
    mass.push_back(1.0 + i);
  }
  Clusters<float> clusters;
  clusters.build(position, mass, 1.0, 2);
  const ClusterArrays<float> a = clusters.arrays();
  double total = 0.0;
  for (std::int64_t s = 0; s < a.count * kClusterSize; ++s) total += static_cast<double>(a.mass[s]);
  EXPECT_EQ(total, 5000.0 * 5001.0 / 2.0);
  for (std::size_t i = 0; i < position.size(); ++i) {
    const std::int64_t slot = clusters.slots()[i];
    EXPECT_EQ(a.mass[slot], static_cast<float>(mass[i]));
    const double coordinates[3] = {position[i].x, position[i].y, position[i].z};
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t cluster = slot / kClusterSize;
      EXPECT_LE(std::abs(a.offset[axis][slot]), a.half[axis][cluster]);
      EXPECT_NEAR(static_cast<double>(a.centre[axis][cluster]) + static_cast<double>(a.offset[axis][slot]),
                  coordinates[axis], 4e-6);
    }
  }
}

// The long-range field at the particles must not hang on which ranks transform the mesh: each for itself, all together,
// only some, or one.
TEST(BoxMesh, AnySharingGivesTheSameField) {
  const mpi::Comm comm;
  const MeshSize size{{27, 27, 27}, {48, 48, 48}};
  std::mt19937_64 random(19);
  std::uniform_real_distribution<double> unit(5.0, 21.0);
  std::vector<Vec3d> position;
  std::vector<double> mass;
  for (int i = 0; i < 600; ++i) {
    const Vec3d x{unit(random), unit(random), unit(random)};
    // The last rank has none.
    if (i % std::max(1, comm.size() - 1) != comm.rank()) continue;
    position.push_back(x);
    mass.push_back(1.0);
  }
  Clusters<double> clusters;
  clusters.build(position, mass, 2.0, 1);
  const auto field_of = [&](const MeshSharing& sharing) {
    SlotField<double> field;
    for (auto& component : field) component.assign(static_cast<std::size_t>(clusters.count() * kClusterSize), 0.0);
    Phases phases;
    BoxMesh<double>(size, {0.8, 3.6, 0.1}, comm, 1, sharing).add_field(clusters, field, phases);
    return field;
  };
  const SlotField<double> replicated = field_of({.replicated_nodes = 1e9});
  for (const int least_planes : {1, 12, 100}) {
    const SlotField<double> shared = field_of({.replicated_nodes = 0.0, .least_planes = least_planes});
    for (std::size_t c = 0; c < 4; ++c) {
      for (std::size_t i = 0; i < shared[c].size(); ++i) {
        // Potentials are a few hundred masses over cell; rounded in transforms of 1e5 points.
        ASSERT_NEAR(shared[c][i], replicated[c][i], 1e-10) << least_planes;
      }
    }
  }
}

Cloud spheres(std::size_t each, std::initializer_list<Vec3d> centres, double radius) {
  Cloud cloud;
  std::mt19937_64 random(11);
  for (const Vec3d c : centres) add_ball(cloud, each, c, radius, random);
  return cloud;
}

bool same(const Box& a, const Box& b) {
  return a.low.x == b.low.x && a.low.y == b.low.y && a.low.z == b.low.z && a.high.x == b.high.x &&
         a.high.y == b.high.y && a.high.z == b.high.z;
}

// A body that is wide in blocks among debris in more blocks than the sieve has counters, dealt into several pieces.
TEST(BlockSieve, CountsCrowdedBlocksLikeAllBlocks) {
  Cloud cloud = spheres(30000, {{0, 0, 0}}, 5e4);
  std::mt19937_64 random(5);
  add_ball(cloud, 70000, {0, 0, 0}, 1e7, random);
  std::shuffle(cloud.position.begin(), cloud.position.end(), random);  // all masses are equal
  const ParticlesView particles{cloud.position, cloud.mass};
  constexpr double kWidth = 8e3;
  constexpr std::int64_t kLeast = 20;
  const Blocks all = count_in_blocks(particles, kWidth);
  ASSERT_GT(all.all().size(), std::size_t{1} << 16);
  for (const int threads : {1, 3}) {
    const BlockSieve sieve(particles, kWidth, threads);
    Blocks some;
    sieve.count_crowded(kLeast, some);
    EXPECT_LT(some.all().size(), all.all().size() / 10);
    // Those next to the crowded ones, too, without counting again what is known.
    std::vector<BlockIndex> next;
    for (const Block& b : some.all()) next.push_back({b.index.x, b.index.y, b.index.z + 1});
    sieve.count(next, some);
    double mass = 0.0;
    for (const Block& b : all.all()) {
      mass += b.mass;
      const std::int64_t place = some.find(b.index);
      EXPECT_TRUE(place >= 0 || b.count < kLeast);
      if (place < 0) continue;
      const Block& found = some.all()[static_cast<std::size_t>(place)];
      EXPECT_EQ(found.count, b.count);
      EXPECT_NEAR(found.mass, b.mass, 1e-12 * b.mass);  // summed in another order
      EXPECT_TRUE(same(found.bounds, b.bounds));
    }
    for (const BlockIndex index : next) EXPECT_EQ(some.find(index) >= 0, all.find(index) >= 0);
    EXPECT_NEAR(sieve.mass(), mass, 1e-12 * mass);
  }
}

std::vector<Box> boxes_of(const Cloud& cloud, double spacing, const mpi::Comm& comm) {
  HostCensus census({cloud.position, cloud.mass}, 1);
  return choose_boxes(census, spacing, 1.3 * spacing, comm);
}
double dense_spacing_of(const Cloud& cloud, const mpi::Comm& comm) {
  HostCensus census({cloud.position, cloud.mass}, 1);
  return dense_spacing(census, comm);
}

TEST(Boxes, FollowTheDenseBodies) {
  const mpi::Comm self(MPI_COMM_SELF);
  const double radius = 5e4;
  const double spacing = radius * std::cbrt(4.0 / 3.0 * kPi / 4000.0);
  Cloud cloud = spheres(4000, {{0, 0, 0}, {2e6, 1e6, 0}}, radius);
  std::vector<Box> boxes = boxes_of(cloud, spacing, self);
  ASSERT_EQ(boxes.size(), 2U);
  for (const Box& b : boxes) {
    EXPECT_LT(b.high.x - b.low.x, 2.01 * radius);
    EXPECT_GT(b.high.x - b.low.x, 1.9 * radius);
  }
  // Their surfaces, where blocks are all but empty, belong to them.
  for (const Vec3d& p : cloud.position) EXPECT_TRUE(boxes[0].contains(p) || boxes[1].contains(p));
  // Close by, one mesh over both is cheaper than two and the tree between them.
  cloud = spheres(4000, {{0, 0, 0}, {1.5e5, 0, 0}}, radius);
  EXPECT_EQ(boxes_of(cloud, spacing, self).size(), 1U);
  // Debris is no body, however much of it there is; nor is a body too light or without enough particles.
  cloud = spheres(8000, {{0, 0, 0}}, 4e7);
  EXPECT_TRUE(boxes_of(cloud, spacing, self).empty());
  cloud = spheres(500, {{0, 0, 0}}, 0.5 * radius);
  EXPECT_TRUE(boxes_of(cloud, spacing, self).empty());
  EXPECT_TRUE(boxes_of({}, spacing, self).empty());
}

// Filled to just about what makes a block dense, with most of each on one rank: the others must count what it names.
TEST(Boxes, AreTheSameHoweverTheParticlesAreDealtOut) {
  const mpi::Comm comm;
  const double spacing = 5e4 * std::cbrt(4.0 / 3.0 * kPi / 20000.0);
  const Cloud cloud = spheres(20000, {{0, 0, 0}}, 5e4);
  Cloud mine;
  for (std::size_t i = 0; i < cloud.position.size(); ++i) {
    const int others = comm.size() - 1;
    const int rank = i % 5 < 4 || others == 0 ? 0 : 1 + static_cast<int>(i / 5) % others;
    if (rank != comm.rank()) continue;
    mine.position.push_back(cloud.position[i]);
    mine.mass.push_back(cloud.mass[i]);
  }
  for (const double fill : {0.30, 0.36, 0.42, 0.48}) {
    const double wide = spacing * std::cbrt(fill);
    const auto alone = boxes_of(cloud, wide, mpi::Comm(MPI_COMM_SELF));
    const auto shared = boxes_of(mine, wide, comm);
    ASSERT_EQ(shared.size(), alone.size()) << "fill " << fill;
    for (std::size_t k = 0; k < alone.size(); ++k) EXPECT_TRUE(same(shared[k], alone[k])) << "fill " << fill;
  }
}

TEST(Boxes, SpacingOfTheDenseParticles) {
  const mpi::Comm self(MPI_COMM_SELF);
  Cloud cloud = spheres(20000, {{0, 0, 0}}, 5e4);
  const double spacing = 5e4 * std::cbrt(4.0 / 3.0 * kPi / 20000.0);
  // Surface blocks are part empty and random places uneven.
  EXPECT_NEAR(dense_spacing_of(cloud, self) / spacing, 1.0, 0.12);
  std::mt19937_64 random(3);
  add_ball(cloud, 5000, {0, 0, 0}, 4e7, random);
  EXPECT_NEAR(dense_spacing_of(cloud, self) / spacing, 1.0, 0.15);
  EXPECT_EQ(dense_spacing_of({}, self), 1.0);
}

}  // namespace
}  // namespace breccia::gravity

// Remnants of made-up collisions whose mass, motion, shape and bound mass are known.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "analysis/remnants.hpp"
#include "breccia/constants.hpp"
#include "breccia/error.hpp"

namespace breccia::analysis {
namespace {

constexpr double kSpacing = 2.5e3;
constexpr double kLink = 3.0 * kSpacing;
constexpr double kParticleMass = 3e13;

void add(ParticleArrays& all, Vec3d position, Vec3d velocity) {
  all.id.push_back(all.size());
  all.position.push_back(position);
  all.velocity.push_back(velocity);
  all.mass.push_back(kParticleMass);
}

// Cubic lattice in an ellipsoid that turns rigidly about its centre.
void add_body(ParticleArrays& all, Vec3d semi_axes, Vec3d centre, Vec3d velocity, Vec3d spin) {
  const auto reach = [](double axis) { return static_cast<int>(axis / kSpacing) + 1; };
  for (int i = -reach(semi_axes.x); i <= reach(semi_axes.x); ++i) {
    for (int j = -reach(semi_axes.y); j <= reach(semi_axes.y); ++j) {
      for (int k = -reach(semi_axes.z); k <= reach(semi_axes.z); ++k) {
        const Vec3d x = kSpacing * Vec3d{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
        if (std::hypot(x.x / semi_axes.x, x.y / semi_axes.y, x.z / semi_axes.z) >= 1.0) continue;
        add(all, centre + x, velocity + cross(spin, x));
      }
    }
  }
}

// This rank's share: dealt out one by one, so that all groups lie on all ranks.
ParticleArrays share(const ParticleArrays& all) {
  const mpi::Comm comm;
  ParticleArrays mine;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (static_cast<int>(i) % comm.size() != comm.rank()) continue;
    mine.id.push_back(all.id[i]);
    mine.position.push_back(all.position[i]);
    mine.velocity.push_back(all.velocity[i]);
    mine.mass.push_back(all.mass[i]);
  }
  return mine;
}

Fragments fragments(const ParticleArrays& all, double target_mass) {
  return find_fragments(share(all), kLink, target_mass, mpi::Comm());
}

TEST(Remnants, EllipsoidFarFromTheOriginIsMeasured) {
  ParticleArrays all;
  const Vec3d centre{3e7, -1e7, 2e7};
  const Vec3d velocity{120.0, -3.0, 40.0};
  const Vec3d spin{1e-4, 0.0, 3e-4};
  add_body(all, {75e3, 50e3, 30e3}, centre, velocity, spin);
  const double mass = kParticleMass * static_cast<double>(all.size());
  const Fragments found = fragments(all, mass / 1.5);
  ASSERT_EQ(found.remnants.size(), 1U);
  const Remnant& r = found.remnants[0];
  EXPECT_EQ(r.label, 0U);
  EXPECT_EQ(r.particles, all.size());
  EXPECT_NEAR(r.mass_over_target, 1.5, 1e-12);
  // 3e4 terms of one sign, each sum rounded to 1.1e-16: at most 3e-12 of 3e7 m.
  EXPECT_NEAR(r.position.x, centre.x, 1e-4);
  EXPECT_NEAR(r.velocity.z, velocity.z, 1e-9);
  // A lattice of 12 spacings along the smallest half axis: 1 % of ragged surface.
  EXPECT_NEAR(r.a, 150e3, 1.5e3);
  EXPECT_NEAR(r.b, 100e3, 1.0e3);
  EXPECT_NEAR(r.c, 60e3, 0.6e3);
  // Rigid rotation: L = I omega returns omega exactly.
  EXPECT_NEAR(r.spin.x, spin.x, 1e-10);
  EXPECT_NEAR(r.spin.z, spin.z, 1e-10);
  EXPECT_NEAR(r.spin_period, 2.0 * kPi / std::sqrt(dot(spin, spin)), 1e-2);
  // Along one axis of a homogeneous ellipsoid the part beyond u half axes is (2 - 3u + u^3)/4: 1 % at u = 0.882.
  EXPECT_NEAR(r.trimmed_extent[0], 0.882 * r.a, 0.02 * r.a);
  // Lattice layers quantise either end by up to one spacing.
  EXPECT_NEAR(r.trimmed_extent[2], 0.882 * r.c, 2.0 * kSpacing);
  EXPECT_EQ(r.shape, ShapeClass::kElongated);
}

TEST(Remnants, ListIsSortedAndSinglesAreCounted) {
  ParticleArrays all;
  add(all, {9e6, 0, 0}, {300, 0, 0});
  add_body(all, {20e3, 20e3, 20e3}, {0, 0, 0}, {}, {});
  const std::size_t small = all.size();
  add_body(all, {40e3, 40e3, 40e3}, {5e5, 0, 0}, {}, {});
  const std::size_t pair = all.size();
  add(all, {0, 3e6, 0}, {});
  add(all, {0, 3e6 + 0.9 * kLink, 0}, {});
  add(all, {0, 0, -4e7}, {});
  const Fragments found = fragments(all, kParticleMass * static_cast<double>(all.size()));
  ASSERT_EQ(found.remnants.size(), 3U);
  EXPECT_EQ(found.remnants[0].label, small);
  EXPECT_EQ(found.remnants[1].label, 1U);
  EXPECT_EQ(found.remnants[2].label, pair);
  EXPECT_EQ(found.remnants[2].b_over_a, 0.0);
  EXPECT_EQ(found.remnants[2].shape, ShapeClass::kSuperCatastrophic);
  EXPECT_TRUE(std::isinf(found.remnants[2].spin_period));
  EXPECT_TRUE(std::isnan(found.remnants[1].bound_mass));
  EXPECT_EQ(found.singles.particles, 2U);
  EXPECT_NEAR(found.singles.mass, 2.0 * kParticleMass, 1.0);
  double mass = found.singles.mass;
  for (const Remnant& r : found.remnants) mass += r.mass;
  EXPECT_NEAR(mass / kParticleMass, static_cast<double>(all.size()), 1e-9);
}

struct ClassCase {
  Vec3d semi_axes;
  double mass_over_target;
  ShapeClass expected;
};

TEST(Remnants, ClassesOfThePaper) {
  const ClassCase cases[] = {
      {{30e3, 28e3, 26e3}, 2.0, ShapeClass::kSpherical},
      {{50e3, 20e3, 20e3}, 1.7, ShapeClass::kElongated},
      {{40e3, 36e3, 16e3}, 1.4, ShapeClass::kFlat},
      {{40e3, 36e3, 20e3}, 0.8, ShapeClass::kHemispherical},
      {{30e3, 30e3, 30e3}, 0.3, ShapeClass::kSuperCatastrophic},
  };
  for (const ClassCase& wanted : cases) {
    ParticleArrays all;
    add_body(all, wanted.semi_axes, {}, {}, {});
    const double mass = kParticleMass * static_cast<double>(all.size());
    EXPECT_EQ(fragments(all, mass / wanted.mass_over_target).remnants.at(0).shape, wanted.expected)
        << class_name(wanted.expected);
  }
}

// Two spheres in contact: second moments R^2/5 + R^2 along their line and R^2/5 across it give b/a = sqrt(1/6).
TEST(Remnants, TouchingSpheresAreBilobed) {
  ParticleArrays all;
  add_body(all, {25e3, 25e3, 25e3}, {-25e3, 0, 0}, {}, {});
  const double target = kParticleMass * static_cast<double>(all.size());
  add_body(all, {25e3, 25e3, 25e3}, {25e3, 0, 0}, {}, {});
  const Remnant whole = fragments(all, target).remnants.at(0);
  EXPECT_NEAR(whole.b_over_a, std::sqrt(1.0 / 6.0), 0.01);
  EXPECT_EQ(whole.shape, ShapeClass::kBilobed);
  const Remnant eroded = fragments(all, target / 0.965).remnants.at(0);
  EXPECT_EQ(eroded.shape, ShapeClass::kElongated);
  EXPECT_EQ(eroded.shape_195, ShapeClass::kElongated);
  EXPECT_EQ(eroded.shape_190, ShapeClass::kBilobed);
}

// A sphere, debris on bound and on unbound orbits around it, and members of the group that only pass through.
TEST(Remnants, BoundMassFollowsTheEscapeSpeed) {
  ParticleArrays all;
  add_body(all, {30e3, 30e3, 30e3}, {1e6, 0, 0}, {10, 0, 0}, {});
  const double mass = kParticleMass * static_cast<double>(all.size());
  const double escape = std::sqrt(2.0 * kGravitationalConstant * mass / 1e5);
  for (int k = 0; k < 10; ++k) {
    const double angle = 0.2 * kPi * k;
    const Vec3d x{0, 1e5 * std::cos(angle), 1e5 * std::sin(angle)};
    const Vec3d out = 1e-5 * x;
    add(all, Vec3d{1e6, 0, 0} + x, Vec3d{10, 0, 0} + (k % 2 == 0 ? 0.8 : 1.2) * escape * out);
  }
  const double surface_escape = std::sqrt(2.0 * kGravitationalConstant * mass / 32e3);
  add(all, {1e6 + 32e3, 0, 0}, {10 + 3.0 * surface_escape, 0, 0});
  const Remnant largest = fragments(all, mass).remnants.at(0);
  EXPECT_NEAR((largest.mass - mass) / kParticleMass, 1.0, 1e-6);
  EXPECT_NEAR((largest.bound_mass - mass) / kParticleMass, 5.0, 1e-6);
}

// Given potentials replace the point mass for members of the group.
TEST(Remnants, BoundMassTakesGivenPotentials) {
  ParticleArrays all;
  add_body(all, {20e3, 20e3, 20e3}, {}, {}, {});
  const ParticleArrays mine = share(all);
  std::vector<double> potential(mine.size(), -100.0);
  for (std::size_t i = 0; i < mine.size(); ++i) {
    if (mine.id[i] < 7) potential[i] = 1.0;
  }
  const mpi::Comm comm;
  const Remnant r = find_fragments(mine, kLink, kParticleMass, comm, potential).remnants.at(0);
  EXPECT_NEAR((r.mass - r.bound_mass) / kParticleMass, 7.0, 1e-6);
}

TEST(Remnants, EmptyScene) {
  const Fragments none = fragments({}, 1.0);
  EXPECT_TRUE(none.remnants.empty());
  EXPECT_EQ(none.singles.particles, 0U);
  EXPECT_THROW(static_cast<void>(find_remnants({}, kLink, 0.0, mpi::Comm())), UsageError);
}

}  // namespace
}  // namespace breccia::analysis

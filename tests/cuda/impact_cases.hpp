// Small scenes, the steps that both engines take, and how their results are compared.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "grid/engine.hpp"
#include "scene/bodies.hpp"
#include "tests/support/flaws.hpp"

namespace breccia::cuda {

using grid::Engine;
using grid::EngineSetup;

inline mpi::Comm self() { return mpi::Comm(MPI_COMM_SELF); }

// Two small spheres, nearly touching, at 300 m/s: compression, shear, yield, flaws and damage within 60 steps.
inline Scene small_impact(Precision precision) {
  Scene scene;
  scene.cell = 6250.0;
  scene.materials.resize(1);
  for (int b = 0; b < 2; ++b) {
    BodyParameters body;
    body.semi_axes = {25e3, 25e3, 25e3};
    body.particles = 250;
    body.first_id = static_cast<std::uint64_t>(b) * body.particles;
    body.position = {b == 0 ? 26e3 : -26e3, b == 0 ? 5e3 : -5e3, 1e3 * b};
    body.velocity = {b == 0 ? -150.0 : 150.0, 10.0, -3.0};
    body.mass = 4.0 / 3.0 * 3.141592653589793 * 25e3 * 25e3 * 25e3 * 2700.0;
    scene.bodies.push_back(body);
  }
  scene.numerics.precision = precision;
  scene.gravity.uniform = {0.01, -0.02, 0.005};
  return scene;
}

// Two clouds with some twenty cells between particles, flying through each other: most share no node with another one,
// some do, and who does changes with every sorting. Their spin, meaningless as it is, strains and heats them.
inline Scene debris(Precision precision) {
  Scene scene = small_impact(precision);
  for (BodyParameters& body : scene.bodies) {
    body.lattice = Lattice::kRandom;
    body.semi_axes = {300e3, 300e3, 300e3};
    body.mass = static_cast<double>(body.particles) * 0.7 * 2700.0 * std::pow(scene.cell, 3);
    body.spin = {1e-3, -2e-3, 1.5e-3};
  }
  return scene;
}

// A block for each particle, and just more of them than fill a hash table of 1024 places half.
inline Scene dust(Precision precision) {
  Scene scene = debris(precision);
  for (BodyParameters& body : scene.bodies) {
    body.particles = 264;
    body.semi_axes = {3000e3, 3000e3, 3000e3};
    body.spin = {};
  }
  scene.bodies[1].first_id = 264;
  return scene;
}

// Both bodies cross the planes between ranks, which lie across x.
inline Scene drifting(Scene scene) {
  for (BodyParameters& body : scene.bodies) body.velocity.x += 600.0;
  return scene;
}

inline EngineSetup setup_for(const Scene& scene) {
  EngineSetup setup;
  setup.cell = scene.cell;
  setup.materials = scene.materials;
  setup.boundaries = scene.boundaries;
  setup.uniform_gravity = scene.gravity.uniform;
  setup.numerics = scene.numerics;
  return setup;
}

using test::flaws_of;

// With the share of this rank.
inline void fill(Engine& engine, const Scene& scene, const mpi::Comm& comm = self()) {
  const ParticleArrays particles = scene::make_particles(scene, comm);
  std::vector<Vec3d> spins;
  for (const BodyParameters& body : scene.bodies) spins.push_back(body.spin);
  engine.insert(particles, flaws_of(scene, particles), spins);
}

// Sorts every 10 steps, then and every 7 steps in two halves.
inline void advance(Engine& engine, int steps, double dt) {
  engine.scatter(0.5 * dt);
  for (int n = 1; n < steps; ++n) {
    engine.update_grid(dt);
    if (n % 10 == 0 || n % 7 == 0) {
      engine.gather(dt);
      if (n % 10 == 0) engine.sort();
      engine.scatter(0.5 * dt);
    } else {
      engine.gather_scatter(dt);
    }
  }
  engine.update_grid(dt);
}

struct Difference {
  double position = 0.0, velocity = 0.0, energy = 0.0, damage = 0.0, density = 0.0, grid_density = 0.0, shear = 0.0,
         gradient = 0.0;
};

inline std::vector<std::size_t> by_id(const ParticleOutput& p) {
  std::vector<std::size_t> place(p.size());
  for (std::size_t i = 0; i < p.size(); ++i) place[p.id[i]] = i;
  return place;
}

// Largest differences over the largest values (positions: over the size of the scene). `a` may be the part of a rank.
inline Difference compare(const ParticleOutput& a, const ParticleOutput& b) {
  const std::vector<std::size_t> in_b = by_id(b);
  Difference d;
  Difference largest{.shear = std::numeric_limits<double>::min()};  // 0 / 0 without shear
  const auto grow = [](double& to, double value) { to = value > to || std::isnan(value) ? value : to; };
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::size_t j = in_b[a.id[i]];
    const Vec3d x = a.position[i] - b.position[j], v = a.velocity[i] - b.velocity[j];
    grow(d.position, std::sqrt(dot(x, x)));
    grow(d.velocity, std::sqrt(dot(v, v)));
    grow(d.energy, std::abs(a.internal_energy[i] - b.internal_energy[j]));
    grow(d.damage, std::abs(a.damage[i] - b.damage[j]));
    grow(d.density, std::abs(a.density[i] - b.density[j]));
    grow(d.grid_density, std::abs(a.grid_density[i] - b.grid_density[j]));
    const Mat3<double> c = a.gradient[i], e = b.gradient[j];
    for (int n = 0; n < 9; ++n) grow(d.gradient, std::abs((&c.xx)[n] - (&e.xx)[n]));
    if (!a.shear_stress.empty()) grow(d.shear, std::abs(a.shear_stress[i] - b.shear_stress[j]));
  }
  for (std::size_t j = 0; j < b.size(); ++j) {
    grow(largest.position, std::sqrt(dot(b.position[j], b.position[j])));
    grow(largest.velocity, std::sqrt(dot(b.velocity[j], b.velocity[j])));
    grow(largest.energy, std::abs(b.internal_energy[j]));
    grow(largest.grid_density, b.grid_density[j]);
    for (int n = 0; n < 9; ++n) grow(largest.gradient, std::abs((&b.gradient[j].xx)[n]));
    if (!b.shear_stress.empty()) grow(largest.shear, b.shear_stress[j]);
  }
  return {d.position / largest.position,
          d.velocity / largest.velocity,
          d.energy / largest.energy,
          d.damage,
          d.density / 2700.0,
          d.grid_density / largest.grid_density,
          d.shear / largest.shear,
          d.gradient / largest.gradient};
}

inline constexpr double kStep = 0.15;  // a sixth of what a wave needs for a cell [s]

inline const material::RuntimeEffects kRock{};
inline const material::RuntimeEffects kGranular{.damage = false, .fully_damaged = true};
inline const material::RuntimeEffects kFluid{.shear = false, .strength = false, .damage = false};

// What the project asks for after 200 steps of a collision.
inline constexpr double kDouble = 1e-11;
inline constexpr double kMixed = 1e-5;
// Strain is summed from differences of node velocities, which in float carry 1e-7 of 150 m/s: a thousandth of the small
// shear of rubble.
inline constexpr double kMixedShear = 1e-3;
// Likewise the velocity gradient itself: of velocities of 150 m/s, differences of some m/s from cell to cell.
inline constexpr double kMixedGradient = 1e-4;

inline void expect_below(const Difference& d, Precision precision, double mixed = kMixed) {
  const double tolerance = precision == Precision::kDouble ? kDouble : mixed;
  EXPECT_LE(d.position, tolerance);
  EXPECT_LE(d.velocity, tolerance);
  EXPECT_LE(d.energy, tolerance);
  EXPECT_LE(d.damage, tolerance);
  EXPECT_LE(d.density, tolerance);
  EXPECT_LE(d.grid_density, tolerance);
  EXPECT_LE(d.shear, precision == Precision::kDouble ? kDouble : kMixedShear);
  EXPECT_LE(d.gradient, precision == Precision::kDouble ? kDouble : kMixedGradient);
}

}  // namespace breccia::cuda

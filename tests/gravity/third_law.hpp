// The pull on a body as the reaction to its own on everything else.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gravity/tree/unsplit.hpp"

namespace breccia::gravity {

/// Mean acceleration of the body [m/s2] on one rank; `in_body`: 1 for its particles. Particles outside feel the body
/// alone, so a tree is right to its opening of that, not of the body's own gravity: 1e-5 of the pull
/// (gravity_body_force), where pairs at a million particles take a minute.
inline Vec3d pull_by_third_law(ParticlesView particles, std::span<const char> in_body, double softening) {
  const mpi::Comm self(MPI_COMM_SELF);
  std::vector<std::uint8_t> set;
  for (const char inside : in_body) set.push_back(inside != 0 ? 1 : 2);
  std::vector<Vec3d> a(set.size());
  std::vector<double> work(set.size());
  Stats stats;
  UnsplitField field({.softening = softening, .opening = 1e-5}, self, 1);
  field.add_to(particles, set, 3, particles.mass.front(), {a, {}, work}, stats);
  Vec3d force{};
  double mass = 0.0;
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (set[i] == 1) {
      mass += particles.mass[i];
    } else {
      force -= particles.mass[i] * a[i];
    }
  }
  return (1.0 / mass) * force;
}

}  // namespace breccia::gravity

// How far accelerations are from direct summation in double.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gravity/solver.hpp"

namespace breccia::gravity {

/// Errors |da|/|a| of some particles. In `max`, |a| counts at least a tenth of its mean: the relative error of a
/// particle that feels next to nothing says nothing.
struct FieldErrors {
  std::int64_t targets = 0;
  double rms = 0.0, median = 0.0, p99 = 0.0, max = 0.0;
};

/// Accelerations [m/s2] of `targets` of this rank (indices into its particles) by all particles of all ranks, summed in
/// double. Collective.
std::vector<Vec3d> direct_acceleration(ParticlesView particles, const std::vector<std::int64_t>& targets,
                                       double softening, const mpi::Comm& comm, int threads);

/// Mean acceleration, by mass, of a body [m/s2]: that by all particles outside, as those inside move it nowhere.
/// `in_body`: 1 for its particles. Float differences of exact coordinates, sums in double: right to 1e-6. Collective.
Vec3d pull_on_body(ParticlesView particles, std::span<const char> in_body, double softening, const mpi::Comm& comm,
                   int threads);

/// What the body has of accelerations of all particles. Collective.
Vec3d mean_acceleration(ParticlesView particles, std::span<const char> in_body, std::span<const Vec3d> acceleration,
                        const mpi::Comm& comm);

/// Errors of accelerations `is` of this rank's targets, with those of the other ranks. Collective; the result is the
/// same on all ranks.
FieldErrors field_errors(std::span<const Vec3d> is, std::span<const Vec3d> should, const mpi::Comm& comm);

/// Compares the accelerations of `count` particles chosen at random from all ranks (all if there are fewer) with direct
/// sums. Collective; the result is the same on all ranks.
FieldErrors verify(ParticlesView particles, std::span<const Vec3d> acceleration, double softening, std::int64_t count,
                   const mpi::Comm& comm, int threads);

}  // namespace breccia::gravity

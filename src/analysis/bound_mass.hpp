// Gravitationally bound mass of a remnant.
#pragma once

#include <cstdint>
#include <span>

#include "breccia/particle_arrays.hpp"
#include "mpi/comm.hpp"

namespace breccia::analysis {

/// Mass [kg] of all particles with v^2/2 + phi < 0 relative to the set of bound particles, which starts as the group
/// `label` of `labels` and is renewed until it no longer changes (physics.md 7, iterative energy criterion).
/// phi is `potential` [J/kg] for members of the group where that span is not empty, and else that of a point of the
/// set's mass at its centre. The point binds particles inside the body too strongly, which matters only for matter
/// faster than the escape speed there. Collective; the ranks agree on whether there is a potential.
double bound_mass(const ParticleArrays& particles, std::span<const std::uint64_t> labels, std::uint64_t label,
                  std::span<const double> potential, const mpi::Comm& comm);

}  // namespace breccia::analysis

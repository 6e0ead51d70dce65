// Particles of the bodies of a scene.
#pragma once

#include "breccia/particle_arrays.hpp"
#include "breccia/scene.hpp"
#include "mpi/comm.hpp"

namespace breccia::scene {

/// Particles of all bodies at t = 0: global ids 0 .. N-1, bodies one after the other, each rank a contiguous share of
/// the ids. Every body has exactly its count of particles, its mass and its centre of mass; velocities are
/// v + spin x (x - centre). What is made does not depend on the number of ranks. Collective; throws IoError on all
/// ranks if a particle file cannot be read.
ParticleArrays make_particles(const Scene& scene, const mpi::Comm& comm);

}  // namespace breccia::scene

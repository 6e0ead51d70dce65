// The particles of one body before they are shared among ranks.
#pragma once

#include <string>

#include "breccia/scene.hpp"
#include "mpi/comm.hpp"
#include "scene/lattice.hpp"
#include "scene/particle_file.hpp"

namespace breccia::scene {

/// Lattice of scene.bodies[index], which must have an analytic shape. Deterministic in scene.seed and index.
LatticeFill body_lattice(const Scene& scene, std::uint32_t index);

/// Summary of a particle file, read by rank 0 only. Collective if there is a communicator.
ParticleFileSummary shared_file_summary(const std::string& path, const mpi::Comm* comm);

}  // namespace breccia::scene

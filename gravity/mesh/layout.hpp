// The boxes of an evaluation and the particles in them.
#pragma once

#include <cstdint>
#include <vector>

#include "gravity/mesh/boxes.hpp"
#include "gravity/method.hpp"

namespace breccia::gravity {

struct Layout {
  double spacing = 0.0;  ///< mean distance of the particles where they are dense [m]
  double cell = 0.0;     ///< of the meshes [m]
  std::vector<Box> boxes;
  std::vector<std::uint8_t> set;     ///< of each particle: 0 outside, k in box k - 1; empty if they are a device's
  std::vector<std::uint64_t> count;  ///< particles of all ranks in each set
  std::vector<double> mass;          ///< of these [kg]
};

/// Chooses boxes and deals the particles out to them; a spacing of 0 is found from the particles. Collective.
Layout lay_boxes(ParticlesView particles, const MeshParameters& mesh, const mpi::Comm& comm, int threads);

/// The same for particles that may lie elsewhere: their sets are not told. Collective.
Layout lay_boxes(Census& census, const MeshParameters& mesh, const mpi::Comm& comm);

/// What the choice of a method needs to know.
Matter matter_of(const Layout& layout);

}  // namespace breccia::gravity

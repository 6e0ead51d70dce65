// Checks that need more than one body or plane.
#pragma once

#include "breccia/scene.hpp"
#include "mpi/comm.hpp"
#include "scene/document.hpp"

namespace breccia::scene {

/// Throws UsageError if two bodies overlap: exactly for two spheres, otherwise if a particle of one lies inside the
/// other. Touching is allowed. Collective if there is a communicator; rank 0 does the work.
void check_overlap(const Scene& scene, const Document& document, const mpi::Comm* comm);

/// Throws UsageError if an analytic body reaches through a boundary plane by more than a tenth of its particle spacing.
void check_inside_boundaries(const Scene& scene, const Document& document);

/// Throws UsageError if a body moves or turns faster than light: a slip of the pen, whose numbers would overflow.
void check_speeds(const Scene& scene, const Document& document);

}  // namespace breccia::scene

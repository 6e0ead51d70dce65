// Which parts of space get a particle mesh: boxes around the dense bodies (gravity.md 5.2).
#pragma once

#include <vector>

#include "gravity/mesh/census.hpp"
#include "mpi/comm.hpp"

namespace breccia::gravity {

/// What a body must have to get a box.
inline constexpr std::int64_t kLeastBoxParticles = 1000;
inline constexpr double kLeastBoxMass = 0.1;  ///< fraction of all mass

/// Up to kMostBoxes boxes that do not overlap, the heaviest body first: bounds of the connected regions filled to at
/// least three eighths at mean distance `spacing` [m] that hold a tenth of the mass and 1000 particles. Boxes that
/// overlap become one, and so do boxes that share a mesh of `cell` [m] at less than twice the cost of two. The same on
/// all ranks, and but for rounding the same for any distribution of the particles. Collective.
std::vector<Box> choose_boxes(Census& census, double spacing, double cell, const mpi::Comm& comm);

/// Nodes of the mesh around `box`, not doubled.
double mesh_nodes(const Box& box, double cell);

/// Mean distance of the particles where they are dense [m]: from the number of neighbours that the
/// median one of those has in its block of space. 1 if there are fewer than two places. Collective.
double dense_spacing(Census& census, const mpi::Comm& comm);

}  // namespace breccia::gravity

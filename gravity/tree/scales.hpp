// How strongly the particles of each cell are accelerated, to weigh errors against.
#pragma once

#include <vector>

#include "gravity/tree/tree.hpp"
#include "mpi/comm.hpp"

namespace breccia::gravity {

/// For each cell the smallest acceleration among its groups, in units of G mass/length^2: the least that sample
/// particles feel from the coarse tree without the cell they are in. Good to some ten percent.
/// Collective: each rank samples its target groups, which in rank order must be all groups.
std::vector<double> acceleration_scales(const Tree& tree, double softening, int threads, const mpi::Comm& comm);

}  // namespace breccia::gravity

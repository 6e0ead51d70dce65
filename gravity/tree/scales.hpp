// How strongly the particles of each cell are accelerated, to weigh errors against.
#pragma once

#include <vector>

#include "gravity/tree/tree.hpp"

namespace breccia::gravity {

/// For each target cell the smallest acceleration among its groups, in units of G mass/length^2: the least that sample
/// particles feel from the coarse tree, together with the pull of the group's own mass. Good to some ten percent.
std::vector<double> acceleration_scales(const Tree& tree, double softening, int threads);

}  // namespace breccia::gravity

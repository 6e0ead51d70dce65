// How strongly the particles of each cell are accelerated, to weigh errors against.
#pragma once

#include <span>
#include <vector>

#include "gravity/tree/tree.hpp"

namespace breccia::gravity {

/// For each cell the smallest acceleration among its groups, in units of G mass/length^2: the least that sample
/// particles feel from the coarse tree without the cell they are in, or what the whole of one of `others` (roots of
/// trees of other particles) does there if that is more. Good to some ten percent. Cells without target groups have the
/// largest double.
std::vector<double> acceleration_scales(const Tree& tree, std::span<const Cell> others, double softening, int threads);

/// Takes the scales of the first `count` cells from their children, but for groups and cells with unknown parts.
void take_least_of_children(const Tree& tree, std::size_t count, std::vector<double>& scales);

}  // namespace breccia::gravity

// What follows from the error that is good enough.
#pragma once

#include <cstdint>

#include "gravity/mesh/split.hpp"
#include "gravity/solver.hpp"

namespace breccia::gravity {

/// Split, cutoff and softening of a box of so many particles (those of all ranks), [cells].
GaussianSplit split_of_box(const Parameters& parameters, double cell, std::uint64_t particles);

/// The same parameters. Throws UsageError for settings that no mesh can have.
const Parameters& with_checked_mesh(const Parameters& parameters);

}  // namespace breccia::gravity

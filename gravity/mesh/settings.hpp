// What follows from the error that is good enough.
#pragma once

#include "gravity/solver.hpp"

namespace breccia::gravity {

/// The same with split and cutoff of the mesh set. Throws UsageError for those that no mesh can have.
Parameters with_mesh_settings(Parameters parameters);

}  // namespace breccia::gravity

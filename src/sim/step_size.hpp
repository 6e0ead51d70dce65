// The time step: fixed by the scene, or the largest stable one (physics.md 5, CFL).
#pragma once

#include <string>

#include "breccia/scene.hpp"
#include "grid/engine.hpp"

namespace breccia::sim {

struct StepSize {
  double seconds = 0.0;
  std::string limited_by;
};

/// cfl times the smaller of (dx/c)(sqrt(1 + k^2) - k), the acoustic limit with viscosity, k = (A1 c0 + A2 dx |tr d|)/c
/// of the stiffest material, and dx/|v|.
StepSize stable_step(const Scene& scene, const grid::SignalSpeeds& speeds, bool viscosity);

/// Signal speeds of the scene at rest, from its parameters alone.
grid::SignalSpeeds initial_speeds(const Scene& scene, bool shear);

}  // namespace breccia::sim

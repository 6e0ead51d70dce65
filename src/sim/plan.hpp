// What a scene will do before it runs: effects with reasons, time step and what limits it, memory.
#pragma once

#include <string>
#include <vector>

#include "breccia/scene.hpp"
#include "sim/effects.hpp"

namespace breccia::sim {

struct Plan {
  std::vector<EffectDecision> effects;
  std::string gravity_method;        ///< "direct", "tree", "treepm" or "off"; with auto what it starts with
  double time_step = 0.0;            ///< first step [s]
  std::string time_step_limited_by;  ///< "fixed by the scene", "acoustic with viscosity", "speed"
  std::uint64_t particles = 0;
  double bytes_per_particle = 0.0;  ///< its fields, without sorting and grid
};

/// Decides the effects and the first time step of a scene.
Plan make_plan(const Scene& scene);

/// What a short run of the real engine tells of this scene. Bytes are those of each of `ranks` ranks that share it
/// evenly.
struct Calibration {
  double seconds_per_step = 0.0;  ///< wall time on one core of this machine [s]
  double host_bytes = 0.0;        ///< of a run on the host, gravity and output included
  double device_bytes = 0.0;      ///< of a run on CUDA devices; 0: this build has no CUDA engine
};
Calibration calibrate(const Scene& scene, int ranks);

}  // namespace breccia::sim

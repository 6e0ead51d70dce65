// What a plan knows of a run before there are particles or a device, for an estimate of the memory it will take.
#pragma once

#include <cstdint>
#include <vector>

#include "breccia/engine_state.hpp"
#include "cuda/gravity_memory.hpp"
#include "gravity/method.hpp"
#include "grid/engine.hpp"

namespace breccia::cuda {

struct DevicePlan {
  grid::EngineSetup setup;
  EngineState sample;       ///< of an engine that holds a part of the particles, as dense as all
  std::uint64_t flaws = 0;  ///< of that
  double scale = 1.0;       ///< all particles over those of the sample
  int ranks = 1;            ///< that share the particles evenly
  GravityMethod gravity = GravityMethod::kOff;
  gravity::Parameters parameters{};
  gravity::Matter matter{};      ///< of the whole scene
  std::vector<BoxLoad> boxes{};  ///< that the particle mesh would have
};

/// Of each rank [bytes].
struct DeviceMemory {
  std::uint64_t engine = 0;   ///< particles, their grid, sorting
  std::uint64_t gravity = 0;  ///< beside them
};

/// Needs no device.
DeviceMemory memory_of(const DevicePlan& plan);

}  // namespace breccia::cuda

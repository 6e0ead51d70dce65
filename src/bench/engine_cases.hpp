// The states the engine is measured in.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "breccia/particle_arrays.hpp"
#include "breccia/scene.hpp"
#include "mpi/comm.hpp"

namespace breccia::bench {

/// Two spheres of radius 50 km that approach each other, gravity off.
struct EngineCase {
  std::string_view name;
  std::uint64_t particles_each;
  double particles_per_cell;
  double debris_share;  ///< of all particles, alone and anywhere out to kDebrisRadius
  bool broken = false;  ///< D = 1 everywhere
};

inline constexpr double kDebrisRadius = 2.0e7;  ///< [m]

/// paper: the paper's baseline. cell8_1e6: well filled cells; broken_1e6: the same with D = 1 everywhere. debris: after
/// an impact. cell8_1e4, cell8_1e5, cell8_1e7, paper_1e6, paper_3e6 and debris_1e6: whether the cost of a particle
/// depends on their number.
std::span<const EngineCase> engine_cases();

/// The effects of a measurement: all of them, or all but one.
struct EffectChoice {
  std::string_view name;
  void (*apply)(EffectSwitches&);
};
std::span<const EffectChoice> effect_choices();

Scene make_scene(const EngineCase& c, const EffectChoice& effects, Precision precision);

/// This rank's share of the particles of the scene; what is debris is taken evenly from the spheres and scattered.
ParticleArrays make_state(const EngineCase& c, const Scene& scene, const mpi::Comm& comm);

}  // namespace breccia::bench

// Bodies read from HDF5: /PartType0/{Coordinates, Velocities, Masses} in SI, optionally Damage.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "breccia/linalg.hpp"

namespace breccia::scene {

/// A whole particle file in a few numbers.
struct ParticleFileSummary {
  std::uint64_t count = 0;
  double mass = 0.0;    ///< [kg]
  Vec3d centre{};       ///< of mass [m]
  Vec3d velocity{};     ///< of the centre of mass [m/s]
  Vec3d half_extent{};  ///< largest |x - centre| per axis [m]
};

struct ParticleFileSlice {
  std::vector<Vec3d> position;  ///< [m]
  std::vector<Vec3d> velocity;  ///< [m/s]
  std::vector<double> mass;     ///< [kg]
  std::vector<double> damage;   ///< empty if the file has none
};

/// Reads and checks the whole file, first in a child process. Throws IoError if it cannot be read or crashes HDF5,
/// UsageError if numbers are not finite, masses are not positive or there are no particles.
ParticleFileSummary summarize_particle_file(const std::string& path);

/// Particles begin .. begin+count-1 in the order of the file. Throws IoError.
ParticleFileSlice read_particle_file(const std::string& path, std::uint64_t begin, std::uint64_t count);

}  // namespace breccia::scene

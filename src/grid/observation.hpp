// What an output step says of a particle, the same for the engines of all devices.
#pragma once

#include <cstdint>

#include "breccia/particle_arrays.hpp"
#include "grid/engine.hpp"

namespace breccia::grid {

/// A particle at t_n as the engine holds it, in plain numbers.
struct ObservedParticle {
  std::uint64_t id = 0;
  Vec3d position{};                 ///< [m]
  Vec3d velocity{};                 ///< mean of both half steps [m/s]
  double mass = 0.0;                ///< [kg]
  double node_mass = 0.0;           ///< sum of w m_i [kg]
  Mat3<double> gradient{};          ///< C^{n+1/2} [1/s]
  std::uint32_t body_material = 0;  ///< body + 65536 * material
  double volume_change = 0.0;       ///< J - 1
  double kirchhoff_pressure = 0.0;  ///< J P [Pa]
  double damage_root = 0.0;         ///< D^(1/3); 0 where no damage is kept
  double energy = 0.0;              ///< specific [J/kg]
  double hencky_norm = 0.0;         ///< |dev h| of the elastic strain
};

/// |dev h| of the elastic strain E = b_e / (tr b_e / 3) - I.
double hencky_norm(const Dev3<double>& strain);

/// Adds what is written of the particle.
void append(ParticleOutput& out, const ObservedParticle& particle, const EngineSetup& setup);

}  // namespace breccia::grid

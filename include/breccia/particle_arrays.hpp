// Particles as plain arrays in SI: what the scene makes, what the engine is filled from, what files and analysis see.
// The engine keeps its own packed form (src/grid/particles.hpp); this one is for everything that is not a hot loop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "breccia/linalg.hpp"

namespace breccia {

/// One entry per particle of this rank; all vectors have the same length unless stated.
struct ParticleArrays {
  std::vector<std::uint64_t> id;        ///< global, 0 .. N-1, bodies one after the other
  std::vector<Vec3d> position;          ///< [m]
  std::vector<Vec3d> velocity;          ///< [m/s]
  std::vector<double> mass;             ///< [kg]
  std::vector<std::uint32_t> body;      ///< index into Scene::bodies
  std::vector<std::uint32_t> material;  ///< index into Scene::materials
  std::vector<double> damage;           ///< D in [0, 1]

  [[nodiscard]] std::size_t size() const { return id.size(); }
};

/// What an output step adds to ParticleArrays; empty vectors where the effect is off.
struct ParticleOutput : ParticleArrays {
  std::vector<double> density;          ///< rho0 / J [kg/m3]
  std::vector<double> grid_density;     ///< mass density of the grid at the particle [kg/m3]
  std::vector<double> internal_energy;  ///< specific [J/kg]
  std::vector<double> pressure;         ///< after damage and apex, q included [Pa]
  std::vector<double> shear_stress;     ///< sqrt(J2) of the Cauchy stress [Pa]
  std::vector<Mat3<double>> gradient;   ///< C^{n+1/2}: what P2G spreads is v + C (x_i - x_p) [1/s]
};

}  // namespace breccia

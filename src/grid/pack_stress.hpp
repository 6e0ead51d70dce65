// What a pack of particles gives to the grid.
#pragma once

#include "grid/tile.hpp"

namespace breccia::grid {

/// What a pack gives to the grid, lanes = particles.
template <class P>
struct PackStress {
  using T = typename P::RealPack;
  Mat3<T> gradient;  ///< C^{n-1/2} [1/s]
  T volume;          ///< reference volume m / rho0 [m3]
  Sym3<T> tau;       ///< Kirchhoff stress [Pa]
};

}  // namespace breccia::grid

// The standard states of the gravity measurements (gravity.md 3).
#pragma once

#include <cstdint>
#include <vector>

#include "breccia/linalg.hpp"

namespace breccia::bench {

struct GravityState {
  std::vector<Vec3d> position;  ///< [m]
  std::vector<double> mass;     ///< [kg]
  std::vector<char> in_body;    ///< 1 for those of the first body
  double softening = 0.0;       ///< 0.05 of the particles' spacing times two [m]
};

/// a: two spheres of radius 50 km, centres 200 km apart. b: three quarters of the mass an ellipsoid with semi-axes 119,
/// 40, 40 km, one quarter single ejecta, as many in each decade of distance up to 2e4 km. c: 49 fragments and 40 %
/// single ejecta between 300 km and 2e4 km. n, f: b with ejecta that reach 1e3 and 4e4 km. p, q: a with the centres
/// 1,000 and 5,000 km apart. Dense matter is a jittered lattice. Particles come in the order of blocks of 64 cells, x
/// slowest, as a run holds them. Throws UsageError for another name.
GravityState gravity_state(char name, std::int64_t particles);

}  // namespace breccia::bench

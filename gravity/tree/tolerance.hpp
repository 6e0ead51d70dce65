// How much error a cell of the tree may have so that the field is as good as asked for.
#pragma once

#include <algorithm>
#include <cmath>

#include "gravity/solver.hpp"

namespace breccia::gravity {

/// Parameters::opening, or what leaves Parameters::error in a state of so many particles (those of all ranks).
///
/// Measured in states a, b, c of gravity.md 3 and in spheres and debris of random places. With 94,648 particles
/// openings of 1.2e-4, 2e-4, 6e-4, 1e-3 leave rms errors of up to 2.3e-4, 2.9e-4, 5.4e-4, 8.4e-4; few or randomly
/// placed particles have up to half as much again. With a million the same opening leaves less, as a particle then
/// feels more cells, whose errors cancel: 3.5e-5, 2.6e-4, 1.05e-3 leave 0.9e-4, 3.0e-4, 6.7e-4. Of the last, 1 % of the
/// errors are beyond 2.6e-3 as with fewer particles: they are those of single cells, so little is gained where cells
/// may err much.
inline double opening_for(const Parameters& parameters, double particles) {
  if (parameters.opening > 0.0) return parameters.opening;
  constexpr double kUsualError = 3.5e-4;
  constexpr double kLeastParticles = 94'648.0;
  constexpr double kMostParticles = 1e6;  // that were measured
  const double error = parameters.error / kUsualError;
  const double growth = std::min(1.0, std::pow(error, -1.4)) / 3.0;
  return 1.2e-4 * std::pow(error, 1.9) *
         std::pow(std::clamp(particles, kLeastParticles, kMostParticles) / kLeastParticles, growth);
}

}  // namespace breccia::gravity

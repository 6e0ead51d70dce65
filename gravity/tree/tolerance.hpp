// How much error a cell of the tree may have so that the field is as good as asked for.
#pragma once

#include <cmath>

#include "gravity/solver.hpp"

namespace breccia::gravity {

/// Parameters::opening, or what leaves Parameters::error. Measured in states a and b of gravity.md 3: openings
/// of 1.2e-4, 2e-4, 6e-4, 1e-3 leave rms errors of 2.3e-4, 2.9e-4, 5.4e-4, 8.4e-4; few or randomly placed particles
/// have up to half as much again.
inline double opening_for(const Parameters& parameters) {
  return parameters.opening > 0.0 ? parameters.opening : 1.2e-4 * std::pow(parameters.error / 3.5e-4, 1.9);
}

}  // namespace breccia::gravity

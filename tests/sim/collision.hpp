// Two small bodies that are about to collide with every effect on: the scene of the tests of conservation and of
// independence from ranks and threads.
#pragma once

#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {

inline constexpr double kBodyRadius = 50e3;

/// Spheres of 100 km that meet at 200 m/s and 15 degrees, 6 km before contact: forces start at a gap of a cell. The
/// step is the same part of a cell as in the flagship run.
inline std::string collision(double cell) {
  return "[scene]\nend = \"1e5 s\"\n[grid]\ncell = \"" + metres(cell) + "\"\n[time]\nstep = \"" +
         seconds(cell / 2500.0 * 0.1220703125) + R"("
[[body]]
shape = "sphere"
radius = "50 km"
[[body]]
shape = "sphere"
radius = "50 km"
[impact]
velocity = "200 m/s"
angle = "15 deg"
separation = "106 km"
[effects]
gravity = "direct"
[numerics]
precision = "double"
)";
}

}  // namespace breccia::sim::test

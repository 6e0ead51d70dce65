// Small scenes with every effect on: what the tests of conservation and of independence from ranks and threads run.
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

/// A slab of rubble, 1 km cells, that slides over a rough floor in x and y; x repeats after `blocks` blocks of 4 cells.
inline std::string periodic_slide(int blocks) {
  const double length = 4e3 * blocks;
  return "[scene]\nend = \"1000 s\"\n[grid]\ncell = \"1 km\"\n[time]\nstep = \"0.05 s\"\n" +
         ("[[body]]\nshape = \"box\"\nlattice = \"cubic\"\nspacing = \"500 m\"\ndamage = 1\nsize = [\"" +
          metres(length) + "\", \"3 km\", \"4 km\"]\nposition = [\"" + metres(0.5 * length)) +
         R"(", 0, "2 km"]
velocity = ["150 m/s", "20 m/s", "-5 m/s"]
[[boundary]]
normal = [0, 0, 1]
kind = "friction"
friction = 0.4
[[boundary]]
normal = [1, 0, 0]
kind = "periodic"
[[boundary]]
normal = [-1, 0, 0]
kind = "periodic"
point = [")" +
         metres(length) + R"(", 0, 0]
[effects]
gravity = "direct"
[gravity]
uniform = [0, 0, "-1 m/s2"]
[numerics]
precision = "double"
)";
}

}  // namespace breccia::sim::test

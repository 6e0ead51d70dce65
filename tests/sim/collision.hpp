// Small scenes with every effect on: what the tests of conservation and of independence from ranks and threads run.
#pragma once

#include <array>
#include <string>

#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {

inline constexpr double kBodyRadius = 50e3;

/// What a scene begins with: cells [m], steps [s], and an end that no test comes to.
inline std::string scene_of(double cell, double step) {
  return "[scene]\nend = \"1e5 s\"\n[grid]\ncell = \"" + metres(cell) + "\"\n[time]\nstep = \"" + seconds(step) +
         "\"\n";
}

/// A spinning ellipsoid that flies along x, its long axis, half of which is `length`: a cell in ten steps, out of all
/// slabs that were cut for it.
inline std::string flying_body(const std::string& length) {
  return scene_of(1e3, 0.05) + "[[body]]\nshape = \"ellipsoid\"\naxes = [\"" + length + R"(", "3 km", "3 km"]
velocity = ["2 km/s", 0, 0]
spin = [0, "0.01 rad/s", "0.02 rad/s"]
)";
}

/// Debris that flies through all slabs, most of it without grid; some of it meets, and a body.
inline std::string debris() {
  return scene_of(2e3, 0.1) + R"([[body]]
shape = "ellipsoid"
axes = ["20 km", "9 km", "8 km"]
[[body]]
shape = "box"
lattice = "random"
particles = 300
size = ["160 km", "100 km", "100 km"]
position = ["130 km", 0, 0]
velocity = ["-2500 m/s", "200 m/s", 0]
spin = [0, "0.02 rad/s", 0]
)";
}

/// Particles that share only their outermost nodes: of 128,000 particles two million nodes, 64 bytes each in mixed
/// precision. Longest along x, across which slabs are cut.
inline std::string many_nodes() {
  return scene_of(1e3, 0.05) + R"([[body]]
shape = "box"
lattice = "cubic"
spacing = "2.5 km"
size = ["200 km", "100 km", "100 km"]
spin = [0, "0.01 rad/s", "0.02 rad/s"]
[effects]
gravity = "off"
)";
}

/// Spheres of 100 km that meet at 200 m/s and 15 degrees, 6 km before contact: forces start at a gap of a cell. The
/// step is the same part of a cell as in the flagship run.
inline std::string collision(double cell) {
  return scene_of(cell, cell / 2500.0 * 0.1220703125) + R"([[body]]
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

/// A vector of a scene file whose components are along `axis` and the two that follow it.
inline std::string from_axis(int axis, const std::array<std::string, 3>& along) {
  const auto of = [&](int d) { return along[static_cast<std::size_t>((d - axis + 3) % 3)]; };
  return "[" + of(0) + ", " + of(1) + ", " + of(2) + "]\n";
}

/// A slab of rubble, 1 km cells, that slides over a rough floor along `axis` and a little across; the axis repeats
/// after `blocks` blocks of 4 cells. The floor's normal is along the axis before it.
inline std::string periodic_slide(int blocks, int axis = 0) {
  const std::string length = "\"" + metres(4e3 * blocks) + "\"";
  const std::string middle = "\"" + metres(2e3 * blocks) + "\"";
  const auto vector = [axis](const std::string& a, const std::string& b, const std::string& c) {
    return from_axis(axis, {a, b, c});
  };
  return scene_of(1e3, 0.05) + R"([[body]]
shape = "box"
lattice = "cubic"
spacing = "500 m"
damage = 1
size = )" +
         vector(length, R"("3 km")", R"("4 km")") + "position = " + vector(middle, "0", R"("2 km")") +
         "velocity = " + vector(R"("150 m/s")", R"("20 m/s")", R"("-5 m/s")") +
         "[[boundary]]\nkind = \"friction\"\nfriction = 0.4\nnormal = " + vector("0", "0", "1") +
         "[[boundary]]\nkind = \"periodic\"\nnormal = " + vector("1", "0", "0") +
         "[[boundary]]\nkind = \"periodic\"\nnormal = " + vector("-1", "0", "0") +
         "point = " + vector(length, "0", "0") +
         R"([effects]
gravity = "direct"
[numerics]
precision = "double"
[gravity]
uniform = )" +
         vector("0", "0", R"("-1 m/s2")");
}

}  // namespace breccia::sim::test

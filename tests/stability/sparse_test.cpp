// Few particles, far apart or too close: nearly empty nodes, debris, one place for two (physics.md 8: 1, 8, 13, 14).
#include <random>

#include "tests/stability/hard_scene.hpp"

namespace breccia::sim::test {
namespace {

class Sparse : public Hard {};

// Row 1. Danger: f_i/m_i of a node that one particle reaches with a tiny weight. Guard: empty is m_i < 1e-30 m_p and no
// epsilon is added, f and m carry the same weight. 300 spinning, hence stretched and stressed particles, each alone,
// anywhere in a cell and a hair from the planes where a weight begins. A particle cannot push itself: its velocity must
// stay. Rounding of forces: 4 tau dt/(rho dx) = 4e3 m/s at the 1e10 Pa of these spins, 1e-7 of it in floats at random
// over 20 steps and 27 nodes: 2e-3 m/s; doubles 1e-9 of that.
TEST_P(Sparse, StressedParticleDoesNotPushItselfAnywhereInACell) {
  constexpr double kCell = 2500.0;
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<double> anywhere(0.0, 1.0);
  std::string text = "[scene]\nend = \"1e3 s\"\n[grid]\ncell = \"2500 m\"\n[time]\nstep = \"0.122 s\"\n";
  const double edges[] = {1e-12, 1.0 - 1e-12, 0.5 + 1e-9, 0.5 - 1e-9, 0.5 + 1e-7, 0.5 - 1e-12};
  for (int i = 0; i < 300; ++i) {
    const auto place = [&](int axis) {
      return i < 216 ? edges[i / (axis == 0 ? 1 : axis == 1 ? 6 : 36) % 6] : anywhere(engine);
    };
    const double cells[3] = {10.0 * (i % 7) + place(0), 10.0 * (i / 7 % 7) + place(1), 10.0 * (i / 49) + place(2)};
    text += "[[body]]\nshape = \"sphere\"\nradius = \"1 km\"\nparticles = 1\nposition = " +
            vector_of(kCell * cells[0], kCell * cells[1], kCell * cells[2], "m") +
            "\nvelocity = [\"30 m/s\", \"-10 m/s\", \"1 m/s\"]\nspin = [0, \"0.3 rad/s\", \"0.6 rad/s\"]\n";
  }
  text += "[effects]\ngravity = \"off\"\ndamage = false\nstrength = false\n";
  // Particles that spin like this tear themselves apart: their tension is work of the rotation, not of an instability.
  text += "[numerics]\nenergy_gain = 1e6\n";
  for (const char* lone : {"numerics.lone_without_grid=false", "numerics.lone_without_grid=true"}) {
    const Course course = follow(scene(text, {lone}), {.steps = 20});
    double stress = 0.0;
    for (std::size_t i = 0; i < course.end.size(); ++i) {
      EXPECT_LT(length(course.end.velocity[i] - Vec3d{30.0, -10.0, 1.0}), is_mixed() ? 5e-3 : 1e-8) << lone;
      stress = std::max(stress, std::abs(course.end.pressure[i]));
    }
    EXPECT_GT(mpi::Comm().max(stress), 1e8) << "nothing was tested";
  }
}

// Row 8. Danger: a lone particle keeps its gradient for ever; I + dt C of a rotation grows by (Omega dt)^2 per step, so
// ln J would be 145 after 1e4 steps and exp overflows a float. Guard: numerics.volume_ratio_max. J ends at the limit.
TEST_P(Sparse, LoneParticleThatExpandsForEverStaysFinite) {
  const std::string text = R"([scene]
end = "1e6 s"
[grid]
cell = "2500 m"
[time]
step = "0.122 s"
[[body]]
shape = "sphere"
radius = "1 km"
particles = 1
damage = 1
spin = [0, 0, "1 rad/s"]
[effects]
gravity = "off"
)";
  for (const char* lone : {"numerics.lone_without_grid=false", "numerics.lone_without_grid=true"}) {
    const Course course = follow(scene(text, {lone}), {.steps = 10000, .every = 1000});
    EXPECT_NEAR(course.last.max_J, 1000.0, 0.1) << lone;
    EXPECT_EQ(course.last.particles, 1U);
  }
}

// Row 13. Danger: memory and keys of a grid that spans the debris. Guard: sparse blocks by key, particles alone in
// their stencil need none. 400 m/s for 1e5 s is 4e7 m; 300 fragments on such a ball, tree gravity, all effects.
TEST_P(Sparse, DebrisOutTo40000KmKeepsItsMomentumAndCostsNothing) {
  const Folder folder;
  ParticleFile debris;
  for (int i = 0; i < 300; ++i) {
    const double r = 4e7 * (i + 1) / 300.0;
    const Vec3d direction{std::cos(2.4 * i) * std::sqrt(1.0 - std::pow(i / 150.0 - 1.0, 2)),
                          std::sin(2.4 * i) * std::sqrt(1.0 - std::pow(i / 150.0 - 1.0, 2)), i / 150.0 - 1.0};
    debris.add(r * direction, r / 1e5 * direction, 3e13);
  }
  debris.write(folder.file("debris.hdf"));
  const Scene cloud = scene(folder, R"([scene]
end = "1e5 s"
[grid]
cell = "2500 m"
[time]
step = "0.122 s"
[[body]]
shape = "particles"
file = "debris.hdf"
[effects]
gravity = "tree"
)");
  const Course course = follow(cloud, {.steps = 200, .every = 50});
  expect_kept(cloud, course);
  // Each of at most 8 blocks where ranks meet and nobody knows whether a fragment is alone; measured 0 on one rank.
  EXPECT_LE(course.last.active_blocks, 8U * 100U);
  EXPECT_LT(course.drift.energy, 1e-5);
}

// Row 14 and two bodies in one place. Danger: 1/0 in gravity, and a grid that cannot tell the two apart. Guard: pairs
// that coincide are left out where nothing softens them, and the self term. They pass through each other's nodes with
// +-10 m/s: momentum stays zero.
TEST_P(Sparse, TwoParticlesInOnePlaceStayFinite) {
  for (const char* gravity : {"direct", "tree", "treepm", "off"}) {
    for (const auto& [speed, softening] : {std::pair{0.0, "0 m"}, {10.0, "0 m"}, {10.0, "125 m"}}) {
      const Folder folder;
      ParticleFile pair;
      pair.add({1.0, 2.0, 3.0}, {speed, 0.0, 0.0}, 3e13);
      pair.add({1.0, 2.0, 3.0}, {-speed, 0.0, 0.0}, 3e13);
      pair.write(folder.file("pair.hdf"));
      const Scene both = scene(folder,
                               "[scene]\nend = \"1e5 s\"\n[grid]\ncell = \"2500 m\"\n[time]\nstep = \"0.122 s\"\n"
                               "[[body]]\nshape = \"particles\"\nfile = \"pair.hdf\"\n[effects]\ngravity = \"" +
                                   std::string(gravity) + "\"\n[gravity]\nsoftening = \"" + softening + "\"\n");
      const Course course = follow(both, {.steps = 200, .every = 20});
      EXPECT_LT(std::abs(course.last.momentum_x), (is_mixed() ? 1e-6 : 1e-12) * course.first.mass * 10.0)
          << gravity << " " << speed << " " << softening;
      EXPECT_LE(course.largest_kinetic, course.first.kinetic_energy * (1.0 + 1e-5))
          << gravity << " " << speed << " " << softening;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Precisions, Sparse, testing::Values("mixed", "double"));

}  // namespace
}  // namespace breccia::sim::test

// What every hard case must keep, whatever happens to its matter: followed through a whole run, on any number of ranks.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>

#include "breccia/error.hpp"
#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {

inline double length(Vec3d v) { return std::sqrt(dot(v, v)); }

/// The extremes of a run. Energies are sums over all ranks [J].
struct Course {
  io::DiagnosticsRow first, last;
  io::Conservation drift;
  double largest_kinetic = 0.0;
  double gained = 0.0;  ///< largest energy residual: what came from nowhere
  double lost = 0.0;    ///< largest negative residual: what the transfer smoothed away
  double min_J = HUGE_VAL, max_J = 0.0;
  ParticleOutput end;  ///< of this rank
};

struct Until {
  double time = HUGE_VAL;
  std::uint64_t steps = ~0ULL;
  std::uint64_t every = 10;  ///< steps between two looks at the budget
};

/// Runs to the first t_n at or after `until` and looks at the budget on the way, which throws NumericsError where a sum
/// is not finite or a particle is missing. Collective.
inline Course follow(const Scene& scene, const Until& until, const mpi::Comm& comm = mpi::Comm()) {
  Course course;
  std::optional<Budget> budget;
  simulate(
      scene,
      [&](const TimeLoop& loop) {
        const bool last = loop.time() >= until.time || loop.step() >= until.steps;
        if (loop.step() % until.every != 0 && !last) return true;
        if (!budget) budget.emplace(loop.solver(), scene, comm);
        ParticleOutput p = loop.engine().observe();
        course.last = budget->row(loop.engine(), p, loop.lost_work());
        if (loop.step() == 0) course.first = course.last;
        course.largest_kinetic = std::max(course.largest_kinetic, course.last.kinetic_energy);
        course.gained = std::max(course.gained, course.last.energy_residual);
        course.lost = std::max(course.lost, -course.last.energy_residual);
        course.min_J = std::min(course.min_J, course.last.min_J);
        course.max_J = std::max(course.max_J, course.last.max_J);
        if (last) course.end = std::move(p);
        return !last;
      },
      comm);
  course.drift = budget->drift();
  return course;
}

/// Sums of weights are 1 to rounding: of floats 6e-8, at random over particles and steps; 1e-6 and 1e-12 of sum m|v|
/// are the bounds of physics.md 7 for 1e4 steps. J within what the state may hold. Counts, mass and finiteness are
/// watched by the budget itself.
inline void expect_kept(const Scene& scene, const Course& course) {
  const bool mixed = scene.numerics.precision == Precision::kMixed;
  EXPECT_LT(course.drift.momentum, mixed ? 1e-6 : 1e-12);
  EXPECT_GT(course.min_J, 0.0);
  EXPECT_LE(course.max_J, 1000.0 * (1.0 + 1e-6));
}

/// Scenes in both precisions.
class Hard : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] static Scene scene(const std::string& text, std::vector<std::string> overrides = {}) {
    overrides.push_back(std::string("numerics.precision=") + GetParam());
    return load(text, overrides);
  }
  [[nodiscard]] static Scene scene(const Folder& folder, const std::string& text) {
    return load(folder, text, {std::string("numerics.precision=") + GetParam()});
  }
  [[nodiscard]] static bool is_mixed() { return std::string(GetParam()) == "mixed"; }
};

inline std::string vector_of(double x, double y, double z, const char* unit) {
  char text[120];
  std::snprintf(text, sizeof text, "[\"%.17g %s\", \"%.17g %s\", \"%.17g %s\"]", x, unit, y, unit, z, unit);
  return text;
}

/// Two spheres of 100 km that come at `speed` [m/s] relative to each other, with a gap of `gap` [m] between them and
/// `offset` [m] across; cell [m].
inline std::string two_spheres(double cell, double speed, double gap, double offset) {
  const double x = 50e3 + 0.5 * gap;
  return "[scene]\nend = \"1e6 s\"\n[grid]\ncell = \"" + metres(cell) + "\"\n" +
         "[[body]]\nshape = \"sphere\"\nradius = \"50 km\"\nposition = " + vector_of(-x, -0.5 * offset, 0, "m") +
         "\nvelocity = " + vector_of(0.5 * speed, 0, 0, "m/s") +
         "\n[[body]]\nshape = \"sphere\"\nradius = \"50 km\"\nposition = " + vector_of(x, 0.5 * offset, 0, "m") +
         "\nvelocity = " + vector_of(-0.5 * speed, 0, 0, "m/s") + "\n";
}

}  // namespace breccia::sim::test

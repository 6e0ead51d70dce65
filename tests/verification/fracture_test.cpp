// Matter that is stretched evenly breaks as Grady and Kipp have it, flaw by flaw (physics.md 7 and 3).
#include <span>

#include "material/damage.hpp"
#include "material/flaws.hpp"
#include "tests/verification/benchmark.hpp"

namespace breccia::sim::test {
namespace {

constexpr double kSide = 12e3, kCell = 1e3;  // [m]
constexpr double kRate = 5e-5;               // [1/s]: thresholds of some 1e-5 are met within 0.3 s
constexpr double kEnd = 0.28;                // [s]

// A box that expands evenly, v = rate x, with one particle per cell. Nothing but inertia acts on it (its bulk modulus
// is 1e-6 of rock's, its shear modulus, which makes the speed of cracks, carries no stress), so that every particle
// inside is stretched by exactly rate t. With FLIP: the affine transfers would carry the gradients of the surface
// inwards.
Scene expanding_box(const Folder& folder, double step) {
  ParticleFile box;
  const int half = static_cast<int>(std::lround(0.5 * kSide / kCell));
  for (int i = -half; i < half; ++i) {
    for (int j = -half; j < half; ++j) {
      for (int k = -half; k < half; ++k) {
        const Vec3d x{(i + 0.5) * kCell, (j + 0.5) * kCell, (k + 0.5) * kCell};
        box.add(x, kRate * x, 2700.0 * kCell * kCell * kCell);
      }
    }
  }
  box.write(folder.file("box.hdf"));
  return load(folder, "[scene]\nend = \"1 s\"\n[grid]\ncell = \"" + metres(kCell) + "\"\n[time]\nstep = \"" +
                          seconds(step) +
                          "\"\n[materials.brittle]\ntillotson_A = \"26.7 kPa\"\ntillotson_B = 0\n[[body]]\n"
                          "shape = \"particles\"\nfile = \"box.hdf\"\n[effects]\ngravity = \"off\"\nshear = false\n"
                          "viscosity = false\nenergy = false\ndamage = true\n[numerics]\nprecision = \"double\"\n"
                          "transfer = \"flip\"\n");
}

// D^(1/3) grows by n_active c_g/R_s, up to (n_active/n)^(1/3): linear between the times at which flaws become active.
double exact_root(std::span<const float> thresholds, double growth, double end) {
  double root = 0.0;
  for (std::size_t active = 1; active <= thresholds.size(); ++active) {
    const auto met = [&](std::size_t flaw) { return std::expm1(static_cast<double>(thresholds[flaw])) / kRate; };
    const double from = met(active - 1), to = active < thresholds.size() ? std::min(met(active), end) : end;
    if (from >= end) break;
    const double n = static_cast<double>(active), all = static_cast<double>(thresholds.size());
    root = std::min(root + n * growth * (to - from), std::max(root, std::cbrt(n / all)));
  }
  return root;
}

struct Broken {
  double error = 0.0, root = 0.0;  // mean of |D^(1/3) - exact| and of D^(1/3)
};
Broken broken_at_the_end(double step) {
  const Folder folder;
  const Scene scene = expanding_box(folder, step);
  const BodyParameters& body = scene.bodies[0];
  const MaterialParameters& material = scene.materials[0];
  const double growth = material::crack_growth_rate(material, kCell * kCell * kCell);
  const ParticleOutput p = state_after(static_cast<std::uint64_t>(std::lround(kEnd / step)), scene);
  Broken broken;
  double count = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec3d x = p.position[i];
    if (std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}) > 0.25 * kSide) continue;
    const std::uint64_t index = p.id[i];
    const auto flaws = material::draw_flaws(body.particles, body.mass / material.eos.rho0, material.damage, scene.seed,
                                            0, {&index, 1});
    const double exact = exact_root(flaws.of(0), growth, kEnd), difference = std::abs(std::cbrt(p.damage[i]) - exact);
    broken.error += difference;
    broken.root += exact;
    count += 1.0;
  }
  broken.error /= count;
  broken.root /= count;
  return broken;
}

// A flaw counts from the start of the step in which its threshold is passed: first order.
TEST(Verification, StretchedMatterBreaksFlawByFlaw) {
  std::vector<std::pair<double, double>> errors;
  for (const double step : {0.02, 0.01, 0.005}) {
    const Broken broken = broken_at_the_end(step);
    record("fracture, steps", "mean error of D^(1/3)", kEnd / step, broken.error, 0.0,
           "exact: each flaw from its threshold on");
    errors.emplace_back(step, broken.error);
    EXPECT_GT(broken.root, 0.2);
  }
  EXPECT_GT(observed_order(errors), 0.9);
}

}  // namespace
}  // namespace breccia::sim::test

// Matter on slopes: an elastic layer on a plane with Coulomb friction, a layer of grains on a rough one (physics.md 7).
#include "tests/verification/benchmark.hpp"

namespace breccia::sim::test {
namespace {

constexpr double kGravity = 10.0, kHeight = 1.0;  // [m/s2], [m]

std::string leaning(double slope) {
  char text[200];
  std::snprintf(text, sizeof text, "[gravity]\nuniform = [\"%.17g m/s2\", 0, \"%.17g m/s2\"]\n",
                kGravity * std::sin(slope), -kGravity * std::cos(slope));
  return text;
}

// A layer of `cells` cells in height, endless along the slope and across; `plane` says what it lies on. Sound is ten
// times as fast as a fall from its top. Without viscosity: q would add to the pressure that friction sees.
Scene layer(int cells, double slope, const std::string& on, const std::vector<std::string>& overrides) {
  const double cell = kHeight / cells, width = 4.0 * cell;
  const std::string size = metres(width), centre = metres(0.5 * width);
  return load("[scene]\nend = \"100 s\"\n[grid]\ncell = \"" + metres(cell) +
                  "\"\n[materials.grains]\ntillotson_A = \"2.7 MPa\"\ntillotson_B = 0\nshear_modulus = \"1.62 MPa\"\n"
                  "friction_cone = \"inner\"\n[[body]]\nshape = \"box\"\nlattice = \"cubic\"\nspacing = \"" +
                  metres(0.5 * cell) + "\"\nsize = [\"" + size + "\", \"" + size + "\", \"1 m\"]\nposition = [\"" +
                  centre + "\", \"" + centre +
                  "\", \"0.5 m\"]\ndamage = 1\n[effects]\ngravity = \"off\"\nenergy = false\n" +
                  "viscosity = false\n[numerics]\nprecision = \"double\"\n" + leaning(slope) + on +
                  endless(width, "[1, 0, 0]") + endless(width, "[0, 1, 0]"),
              overrides);
}

struct Motion {
  double time = 0.0;
  Vec3d velocity{};  // mean of what lies above `above`
};
std::vector<Motion> motion_at(const Scene& scene, const std::vector<double>& times, double above) {
  std::vector<Motion> found;
  simulate(scene, [&](const TimeLoop& loop) {
    if (loop.time() < times[found.size()]) return true;
    const ParticleOutput p = loop.engine().observe();
    Motion motion{loop.time(), {}};
    double count = 0.0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      if (p.position[i].z > above) motion.velocity += p.velocity[i], count += 1.0;
    }
    motion.velocity = (1.0 / count) * motion.velocity;
    found.push_back(motion);
    return found.size() < times.size();
  });
  return found;
}

// Grains shear at constant volume, where the stress of the Drucker-Prager cone is tau = k P and all normal stresses are
// P: k = 6 sin/(sqrt(3) (3 + sin)) = 0.611 for 40 degrees and the inner cone. Of a layer that slides all is at yield,
// so that it moves as a block with g (sin - k cos) over a thin sheet at its foot, whatever its height. The sheet is a
// cell thick, of H cells: of first order; the upper half is measured, from when the bounce of the start has died.
// Finer layers have motion along the slope grow out of rounding within that time (docs/verification.md).
TEST(Verification, GrainsSlideOnASteepSlope) {
  const double sine = std::sin(40.0 * kPi / 180.0), k = 6.0 * sine / (std::sqrt(3.0) * (3.0 + sine));
  ASSERT_NEAR(k, 0.611258, 1e-6);
  const double slope = std::atan(1.1 * k), exact = kGravity * (std::sin(slope) - k * std::cos(slope));
  std::vector<std::pair<double, double>> errors;
  for (const int cells : {4, 6, 9}) {
    const auto m = motion_at(layer(cells, slope, plane({}, "[0, 0, 1]", "stick"), {}), {0.7, 1.1}, 0.5 * kHeight);
    const double measured = (m[1].velocity.x - m[0].velocity.x) / (m[1].time - m[0].time);
    record("grains on a slope", "acceleration at 1.1 of the limit [m/s2]", cells, measured, exact,
           "derived: g (sin - k cos)");
    errors.emplace_back(1.0 / cells, measured / exact - 1.0);
  }
  EXPECT_GT(observed_order(errors), 0.8);
  EXPECT_LT(std::abs(errors[2].second), 0.04);
}

// At 0.9 of that slope they rest. There is no order in this: yield is a threshold. What is left is swinging in shear,
// at a thousandth of the 5 m/s of a free slide.
TEST(Verification, GrainsRestOnASlope) {
  const double sine = std::sin(40.0 * kPi / 180.0),
               slope = std::atan(0.9 * 6.0 * sine / (std::sqrt(3.0) * (3.0 + sine)));
  for (const int cells : {4, 6, 9}) {
    const auto m = motion_at(layer(cells, slope, plane({}, "[0, 0, 1]", "stick"), {}), {1.0, 2.0}, 0.0);
    record("grains on a slope", "speed at 0.9 of the limit [m/s]", cells, m[1].velocity.x, 0.0,
           "rests: no order, a threshold");
    EXPECT_LT(std::abs(m[1].velocity.x), 0.01) << cells;
  }
}

// A layer without strength on a Coulomb plane of half the slope: all of its foot slides, and friction takes mu times
// the impulse of the plane, which is that of the weight and of the vertical motion: v_x = g (sin - mu cos) t - mu v_z.
// But for the first moments, when the foot rings and nodes of it are let go or stick: second order is observed.
TEST(Verification, BlockSlidesByCoulombsLaw) {
  constexpr double kFriction = 0.3;
  const double slope = std::atan(2.0 * kFriction), exact = kGravity * (std::sin(slope) - kFriction * std::cos(slope));
  std::vector<std::pair<double, double>> errors;
  for (const int cells : levels({4, 6, 9}, {13})) {
    const Scene scene = layer(cells, slope, plane({}, "[0, 0, 1]", "friction") + "friction = 0.3\n",
                              {"effects.strength=false", "effects.damage=false"});
    const Motion m = motion_at(scene, {1.0}, 0.0)[0];
    const double measured = (m.velocity.x + kFriction * m.velocity.z) / m.time;
    record("sliding block", "acceleration [m/s2]", cells, measured, exact, "exact: g (sin - mu cos)");
    errors.emplace_back(1.0 / cells, measured / exact - 1.0);
    EXPECT_NEAR(measured, exact, 0.002 * exact) << cells;
  }
  EXPECT_GT(observed_order(errors), 1.5);
}

}  // namespace
}  // namespace breccia::sim::test

// Plane shocks: a slab of fluid rock flies into a wall, which is the symmetric impact of two (physics.md 7 and 2).
#include "tests/verification/benchmark.hpp"

namespace breccia::sim::test {
namespace {

struct Hugoniot {
  double particle_speed, shock_speed, density, pressure;  // [m/s, m/s, kg/m3, Pa]
};
struct Shock {
  double shock_speed = 0.0, density = 0.0, pressure = 0.0, energy = 0.0;
};

// A slab of 1 m. The wall takes momentum at the rate P = rho0 U_s u_p per area; between the times when the shock has
// gone a quarter and three quarters of the way. The state is that of the particles between 0.3 and 0.55, away
// from the heating at the wall, at the later time.
Shock shock(int cells, const Hugoniot& h) {
  const double cell = 1.0 / cells, width = 4.0 * cell;
  const std::string text = "[scene]\nend = \"1 s\"\n[grid]\ncell = \"" + metres(cell) + "\"\n" +
                           "[[body]]\nshape = \"box\"\nlattice = \"cubic\"\nspacing = \"" + metres(0.5 * cell) +
                           "\"\nsize = [\"1 m\", \"" + metres(width) + "\", \"" + metres(width) +
                           "\"]\nposition = [\"0.5 m\", \"" + metres(0.5 * width) + "\", \"" + metres(0.5 * width) +
                           "\"]\nvelocity = [\"" + metres(-h.particle_speed) + "/s\", 0, 0]\n" +
                           "[effects]\ngravity = \"off\"\nshear = false\n[numerics]\nprecision = \"double\"\n" +
                           plane({}, "[1, 0, 0]", "slip") + endless_across(width);
  const double early = 0.25 / h.shock_speed, late = 0.75 / h.shock_speed;
  double momentum = 0.0, time = 0.0;
  Shock result;
  simulate(load(text), [&](const TimeLoop& loop) {
    const bool first = time == 0.0 && loop.time() >= early, last = loop.time() >= late;
    if (!first && !last) return true;
    const ParticleOutput p = loop.engine().observe();
    double sum = 0.0;
    for (std::size_t i = 0; i < p.size(); ++i) sum += p.mass[i] * p.velocity[i].x;
    if (!last) {
      momentum = sum;
      time = loop.time();
      return true;
    }
    const double area = width * width;
    result.shock_speed = (sum - momentum) / (loop.time() - time) / (2700.0 * h.particle_speed * area);
    const double compressed = 1.0 - h.particle_speed / h.shock_speed;
    double inside = 0.0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      if (p.position[i].x < 0.3 * compressed || p.position[i].x > 0.55 * compressed) continue;
      result.density += p.density[i];
      result.pressure += p.pressure[i];
      result.energy += p.internal_energy[i];
      inside += 1.0;
    }
    result.density /= inside, result.pressure /= inside, result.energy /= inside;
    return false;
  });
  return result;
}

// Computed Hugoniot states of Tillotson basalt (physics.md 2): U_s, P and rho within 1 % at the finest of three levels.
// E is too high by the heat of the start, when the shock is thinner than q spreads it: some 1/strength cells, 40 at 50
// m/s. It must fall from level to level, and be within 3 % where the shock is strong enough to have formed, 6 % at 50
// m/s.
TEST(Verification, HugoniotStates) {
  for (const Hugoniot& h :
       {Hugoniot{50, 3219.7597, 2742.589979, 4.3466756e8}, Hugoniot{200, 3446.2472, 2866.345929, 1.8609735e9},
        Hugoniot{1000, 4683.8868, 3432.921540, 1.2646494e10}}) {
    const double energy = 0.5 * h.particle_speed * h.particle_speed;
    const std::string name = "shock, u_p = " + std::to_string(static_cast<int>(h.particle_speed)) + " m/s";
    const char* source = "computed: jump conditions of Tillotson basalt";
    double last_error = HUGE_VAL;
    Shock s;
    for (const int cells : {48, 96, 192}) {
      s = shock(cells, h);
      record(name.c_str(), "U_s [m/s]", cells, s.shock_speed, h.shock_speed, source);
      record(name.c_str(), "P [Pa]", cells, s.pressure, h.pressure, source);
      record(name.c_str(), "rho [kg/m3]", cells, s.density, h.density, source);
      record(name.c_str(), "E [J/kg]", cells, s.energy, energy, source);
      EXPECT_LT(std::abs(s.energy - energy), last_error) << h.particle_speed << " " << cells;
      last_error = std::abs(s.energy - energy);
    }
    EXPECT_NEAR(s.shock_speed, h.shock_speed, 0.01 * h.shock_speed);
    EXPECT_NEAR(s.pressure, h.pressure, 0.01 * h.pressure);
    EXPECT_NEAR(s.density, h.density, 0.01 * h.density);
    EXPECT_NEAR(s.energy, energy, (h.particle_speed < 100.0 ? 0.06 : 0.03) * energy);
  }
}

}  // namespace
}  // namespace breccia::sim::test

// Plane elastic waves in uniaxial strain: the speed of sound of the whole step (physics.md 7).
#include <gtest/gtest.h>

#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {
namespace {

constexpr double kLength = 1000.0;  // [m]
constexpr int kThickness = 4;       // cells across the bar
constexpr double kSpeed = 1.0;      // amplitude [m/s]: strains of 2e-4, so the wave is linear to about as much

// A bar of kLength along x with eight particles per cell and v_x = kSpeed sin(wavenumber x).
void write_bar(const std::string& path, int cells, double wavenumber) {
  const double spacing = 0.5 * kLength / cells;
  ParticleFile file;
  for (int i = 0; i < 2 * cells; ++i) {
    const double x = (i + 0.5) * spacing;
    for (int j = 0; j < 2 * kThickness; ++j) {
      for (int k = 0; k < 2 * kThickness; ++k) {
        file.add({x, (j + 0.5) * spacing, (k + 0.5) * spacing}, {kSpeed * std::sin(wavenumber * x), 0.0, 0.0},
                 2700.0 * spacing * spacing * spacing);
      }
    }
  }
  file.write(path);
}

std::string plane(double x, double y, double z, const char* normal, const char* kind) {
  return "[[boundary]]\npoint = [\"" + metres(x) + "\", \"" + metres(y) + "\", \"" + metres(z) + "\"]\nnormal = " +
         normal + "\nkind = \"" + kind + "\"\n";
}

// Period of the standing wave sin(wavenumber x) cos(omega t) in a bar of `cells` between planes of this kind, from its
// first four changes of sign, 1.5 periods.
double standing_wave_period(int cells, double wavenumber, const char* ends, const char* sides,
                            const std::vector<std::string>& overrides) {
  const double cell = kLength / cells;
  const double width = kThickness * cell;
  const Folder folder;
  write_bar(folder.file("bar.hdf"), cells, wavenumber);
  // A fifth of a cell per step: the leapfrog's own error, (omega dt)^2/24, is 2e-4 at 20 cells per wavelength.
  const std::string text = "[scene]\nend = \"1 s\"\n[grid]\ncell = \"" + metres(cell) + "\"\n[time]\nstep = \"" +
                           seconds(0.2 * cell / kLongitudinalSpeed) +
                           "\"\n[[body]]\nshape = \"particles\"\nfile = \"bar.hdf\"\n"
                           "[effects]\ngravity = \"off\"\nstrength = false\ndamage = false\nviscosity = false\n" +
                           plane(0, 0, 0, "[1, 0, 0]", ends) + plane(kLength, 0, 0, "[-1, 0, 0]", ends) +
                           plane(0, 0, 0, "[0, 1, 0]", sides) + plane(0, width, 0, "[0, -1, 0]", sides) +
                           plane(0, 0, 0, "[0, 0, 1]", sides) + plane(0, 0, width, "[0, 0, -1]", sides);
  const Scene scene = load(folder, text, overrides);
  ZeroCrossings crossings;
  simulate(scene, [&](const TimeLoop& loop) {
    const ParticleOutput p = loop.engine().observe();
    double amplitude = 0.0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      amplitude += p.velocity[i].x * std::sin(wavenumber * p.position[i].x);
    }
    crossings.sample(loop.time(), amplitude);
    return crossings.count() < 4 && loop.time() < 4.0 * kLength / kLongitudinalSpeed;
  });
  return crossings.count() == 4 ? crossings.period() : 0.0;
}

double periodic_error(int cells, const std::vector<std::string>& overrides) {
  const double exact = kLength / kLongitudinalSpeed;
  const double period = standing_wave_period(cells, 2.0 * kPi / kLength, "periodic", "periodic", overrides);
  std::printf("%d %g\n", cells, period/exact-1.0);
  return std::abs(period / exact - 1.0);
}

class ElasticWave : public testing::TestWithParam<std::vector<std::string>> {};

// Without walls only dispersion errs, (k dx)^2/24 = 0.4 % of a centred scheme at 20 cells per wavelength.
TEST_P(ElasticWave, HasTheLongitudinalSpeed) { EXPECT_LT(periodic_error(20, GetParam()), 0.01); }

INSTANTIATE_TEST_SUITE_P(Precisions, ElasticWave,
                         testing::Values(std::vector<std::string>{"numerics.precision=mixed"},
                                         std::vector<std::string>{"numerics.precision=double"},
                                         std::vector<std::string>{"numerics.precision=double", "effects.energy=false"},
                                         std::vector<std::string>{"numerics.transfer=apic"}));

TEST(ElasticWaveConvergence, IsSecondOrder) {
  const std::vector<std::string> exactly{"numerics.precision=double"};
  const double e[4] = {periodic_error(8, exactly), periodic_error(16, exactly), periodic_error(32, exactly),periodic_error(64, exactly)};
  std::printf("%g %g %g %g\n", e[0], e[1], e[2],e[3]);
}

TEST(ElasticWaveBetweenWalls, x) {
  for (int cells : {10, 20, 40}) {
  const double period = standing_wave_period(cells, kPi / kLength, "slip", "periodic", {"numerics.precision=double"});
  const double period2 = standing_wave_period(cells, kPi / kLength, "slip", "slip", {"numerics.precision=double"});
  std::printf("%d %g %g\n", cells, period*kLongitudinalSpeed/kLength/2-1, period2*kLongitudinalSpeed/kLength/2-1);
  }
}

}  // namespace
}  // namespace breccia::sim::test

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
  return "[[boundary]]\npoint = [\"" + metres(x) + "\", \"" + metres(y) + "\", \"" + metres(z) +
         "\"]\nnormal = " + normal + "\nkind = \"" + kind + "\"\n";
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

// Period over the exact one, minus 1.
double periodic_error(int cells, const std::vector<std::string>& overrides) {
  const double exact = kLength / kLongitudinalSpeed;
  return standing_wave_period(cells, 2.0 * kPi / kLength, "periodic", "periodic", overrides) / exact - 1.0;
}

class ElasticWave : public testing::TestWithParam<std::vector<std::string>> {};

// Velocity gradient and force of MLS-MPM are centred differences with the symbol
// -(4/h^2) d/dk sinc^3(k h/2) = k (1 - 13/120 (k h)^2 + ...): waves are slow and periods long by 13/120 (k h)^2, 1.07 %
// at 20 cells per wavelength. The rest, 5e-4, covers the leapfrog's (omega dt)^2/24 = 2e-4, terms of (k h)^4 = 1e-2
// with small factors, and strains of 2e-4.
TEST_P(ElasticWave, HasTheLongitudinalSpeed) {
  const double wavenumber = 2.0 * kPi / 20.0;  // times h
  EXPECT_NEAR(periodic_error(20, GetParam()), 13.0 / 120.0 * wavenumber * wavenumber, 5e-4);
}

INSTANTIATE_TEST_SUITE_P(Variants, ElasticWave,
                         testing::Values(std::vector<std::string>{"numerics.precision=mixed"},
                                         std::vector<std::string>{"numerics.precision=double"},
                                         std::vector<std::string>{"effects.energy=false"},
                                         std::vector<std::string>{"numerics.transfer=apic"}));

// The error falls by 4 from grid to grid, and what remains of it after Richardson's extrapolation is c_l itself.
TEST(ElasticWaveConvergence, IsSecondOrder) {
  const std::vector<std::string> exactly{"numerics.precision=double"};
  const double coarse = periodic_error(16, exactly), fine = periodic_error(32, exactly);
  EXPECT_GT(std::log2(coarse / fine), 1.9);
  EXPECT_NEAR((4.0 * fine - coarse) / 3.0, 0.0, 3e-4);
}

// Nodes on a wall stand still, but the splines of the first free node reach beyond it: matter may move a little at the
// wall. That is first order in h and part of the scheme, some 0.2 h at each end; it must vanish with h. Frictionless
// sides change nothing that is larger than 1e-3: the wave has no motion across.
TEST(ElasticWaveConvergence, IsFirstOrderBetweenSlipPlanes) {
  const std::vector<std::string> exactly{"numerics.precision=double"};
  const double exact = 2.0 * kLength / kLongitudinalSpeed;
  const auto error = [&](int cells, const char* sides) {
    return standing_wave_period(cells, kPi / kLength, "slip", sides, exactly) / exact - 1.0;
  };
  const double coarse = error(20, "slip"), fine = error(40, "slip");
  EXPECT_LT(std::abs(fine), 0.01);
  EXPECT_LT(std::abs(fine), 0.55 * std::abs(coarse));
  EXPECT_NEAR(error(20, "periodic"), coarse, 1e-3);
}

}  // namespace
}  // namespace breccia::sim::test

// Waves in bars with exact periods: endless ones in uniaxial strain, thin ones in uniaxial stress (physics.md 7).
#include "tests/verification/benchmark.hpp"

namespace breccia::sim::test {
namespace {

constexpr double kLength = 1000.0;  // [m]
constexpr double kDensity = 2700.0, kBulk = 2.67e10, kShear = 2.27e10;

// Period of v_x = sin(wavenumber x) cos(omega t) in a bar of 8 particles per cell, `across` cells thick.
double period_of_standing_wave(int cells, int across, double wavenumber, int crossings_wanted,
                               const std::string& boundaries) {
  const double cell = kLength / cells, spacing = 0.5 * cell;
  ParticleFile bar;
  for (int i = 0; i < 2 * cells; ++i) {
    const double x = (i + 0.5) * spacing;
    for (int j = 0; j < 2 * across; ++j) {
      for (int k = 0; k < 2 * across; ++k) {
        bar.add({x, (j + 0.5) * spacing, (k + 0.5) * spacing}, {std::sin(wavenumber * x), 0, 0},
                kDensity * spacing * spacing * spacing);
      }
    }
  }
  const Folder folder;
  bar.write(folder.file("bar.hdf"));
  const Scene scene = load(folder, "[scene]\nend = \"10 s\"\n[grid]\ncell = \"" + metres(cell) +
                                       "\"\n[time]\nstep = \"" + seconds(0.2 * cell / kLongitudinalSpeed) +
                                       "\"\n[[body]]\nshape = \"particles\"\nfile = \"bar.hdf\"\n[effects]\n"
                                       "gravity = \"off\"\nstrength = false\ndamage = false\nviscosity = false\n"
                                       "[numerics]\nprecision = \"double\"\n" +
                                       boundaries);
  ZeroCrossings crossings;
  const auto wanted = static_cast<std::size_t>(crossings_wanted);
  simulate(scene, [&](const TimeLoop& loop) {
    const ParticleOutput p = loop.engine().observe();
    double amplitude = 0.0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      amplitude += p.velocity[i].x * std::sin(wavenumber * p.position[i].x);
    }
    crossings.sample(loop.time(), amplitude);
    return crossings.count() < wanted && loop.time() < 9.0;
  });
  return crossings.count() == wanted ? crossings.period() : 0.0;
}

// Endless bar: omega = 2 pi c_l/L. Three levels; the symbol of the scheme is of second order (sim_elastic_wave has its
// coefficient), so 1.8 leaves room for the fourth order only.
TEST(Verification, ElasticWaveIsSecondOrderInSpace) {
  const double exact = kLength / kLongitudinalSpeed;
  std::vector<std::pair<double, double>> errors;
  for (const int cells : {12, 20, 40}) {
    const double period =
        period_of_standing_wave(cells, 4, 2.0 * kPi / kLength, 4,
                                plane({}, "[1, 0, 0]", "periodic") + plane({kLength, 0, 0}, "[-1, 0, 0]", "periodic") +
                                    endless_across(4.0 * kLength / cells));
    record("elastic wave", "period [s]", cells, period, exact, "exact: L/c_l");
    errors.emplace_back(1.0 / cells, period / exact - 1.0);
  }
  EXPECT_GT(observed_order(errors), 1.8);
  EXPECT_LT(std::abs(errors[1].second), 0.012);
}

// Thin bar, one end in a slip plane, the other and the sides free: omega = pi/(2 L) sqrt(E/rho), a tenth as thick as
// long. Rayleigh: lateral inertia lengthens the period by (nu k)^2 w^2/12 = 2.6e-5. Free surfaces reach half a cell
// beyond the particles and the wall holds its nodes, both of first order in h: 1/20 of a cell's share at each end.
TEST(Verification, ThinBarConvergesToYoungsModulus) {
  const double young = 9.0 * kBulk * kShear / (3.0 * kBulk + kShear);
  const double exact = 4.0 * kLength / std::sqrt(young / kDensity);
  std::vector<std::pair<double, double>> errors;
  for (const int cells : {20, 40, 60}) {
    const double period =
        period_of_standing_wave(cells, cells / 10, 0.5 * kPi / kLength, 3, plane({}, "[1, 0, 0]", "slip"));
    record("thin bar", "period [s]", cells, period, exact, "exact: 4 L sqrt(rho/E)");
    errors.emplace_back(1.0 / cells, period / exact - 1.0);
  }
  EXPECT_GT(observed_order(errors), 0.8);
  EXPECT_LT(std::abs(errors.back().second), 0.02);
}

}  // namespace
}  // namespace breccia::sim::test

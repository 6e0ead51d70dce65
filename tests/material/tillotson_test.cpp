// Tillotson equation of state: the check points of physics.md 2, the Hugoniot, continuity and the guards.
#include "material/tillotson.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "breccia/error.hpp"
#include "breccia/pack.hpp"
#include "material/eos.hpp"

namespace {

using namespace breccia::material;
using breccia::Pack;
using breccia::TillotsonParameters;

struct CheckPoint {
  double density, energy;
  const char* branch;
  double pressure, sound_speed_squared;
};

// Closed form and complex-step derivatives agree on these to 2e-16.
constexpr CheckPoint kCheckPoints[] = {
    {2700.0, 0.0, "comp", 0.0, 9.888888888888888e6},
    {2700.27, 0.0, "comp", 2.670266999999706e6, 9.892844444444444e6},
    {2835.0, 1e4, "comp", 1.458449207993632e9, 1.192663764377844e7},
    {3240.0, 1e6, "comp", 1.288107968331720e10, 2.378088695981831e7},
    {4050.0, 3e7, "comp", 2.581682378414390e11, 2.033752337077173e8},
    {2699.73, 1e2, "cold", -2.129787083170224e6, 9.885533333788592e6},
    {2565.0, 1e4, "cold", -1.216950875371849e9, 7.971143152734966e6},
    {1080.0, 1e6, "cold", -4.268527116066902e9, -7.714643556346951e6},
    {2160.0, 1e7, "mix", 3.585553292822049e10, 6.056024262345402e7},
    {1350.0, 1e7, "mix", 1.412196770401002e10, 2.204988879509197e7},
    {2160.0, 3e7, "hot", 9.614988625900473e10, 2.042762752955562e8},
    {540.0, 3e7, "hot", 8.100000000000000e9, 2.25e7},
    {27.0, 5e7, "hot", 6.75e8, 3.75e7},
    {2.7, 1e3, "cold", -2.667062360457230e7, -1.639572970139131e7},
};

TEST(Tillotson, CheckPoints) {
  const TillotsonParameters basalt;
  for (const CheckPoint& p : kCheckPoints) {
    const EosPoint point = evaluate_eos(basalt, p.density, p.energy);
    EXPECT_NEAR(point.pressure, p.pressure, 1e-12 * std::abs(p.pressure)) << p.density << " " << p.energy;
    EXPECT_NEAR(point.sound_speed_squared, p.sound_speed_squared, 1e-12 * std::abs(p.sound_speed_squared));
    EXPECT_STREQ(eos_branch_name(point.branch), p.branch);
    EXPECT_DOUBLE_EQ(point.sound_speed, std::sqrt(std::max(p.sound_speed_squared, basalt.A / basalt.rho0)));
  }
}

TEST(Tillotson, VolumeChangeGivesTheSamePressureAsDensity) {
  const auto k = make_tillotson_constants<double>({});
  const auto kf = make_tillotson_constants<float>({});
  for (const CheckPoint& p : kCheckPoints) {
    const double j = (2700.0 - p.density) / p.density;
    EXPECT_NEAR(tillotson_pressure(k, j, p.energy), p.pressure, 1e-12 * std::abs(p.pressure));
    // In float the rounding of j and E enters as dP = rho c^2 dj + 2 rho dE, a few ulp of the larger of both.
    const double scale = std::abs(2.67e10 * j) + 2.0 * p.density * p.energy + std::abs(p.pressure);
    EXPECT_NEAR(double(tillotson_pressure(kf, float(j), float(p.energy))), p.pressure, 1e-6 * scale);
  }
}

TEST(Tillotson, HugoniotJumpConditions) {
  struct Row {
    double particle_speed, shock_speed, density, pressure;
  };
  const TillotsonParameters basalt;
  for (const Row& row :
       {Row{50.0, 3219.7597, 2742.589979, 4.3466756e8}, Row{100.0, 3295.0575, 2784.505522, 8.8966552e8},
        Row{200.0, 3446.2472, 2866.345929, 1.8609735e9}, Row{1000.0, 4683.8868, 3432.921540, 1.2646494e10}}) {
    // Energy jump E = u^2/2 = P (V0 - V) / 2 fixes the density; mass gives the shock speed; momentum must follow.
    const double u = row.particle_speed, energy = 0.5 * u * u;
    double low = 2700.0, high = 4000.0;
    const auto excess = [&](double rho) {
      return 0.5 * evaluate_eos(basalt, rho, energy).pressure * (1.0 / 2700.0 - 1.0 / rho) - energy;
    };
    for (int i = 0; i < 200; ++i) (excess(0.5 * (low + high)) < 0.0 ? low : high) = 0.5 * (low + high);
    const double rho = 0.5 * (low + high);
    const double shock_speed = u * rho / (rho - 2700.0);
    const double pressure = evaluate_eos(basalt, rho, energy).pressure;
    EXPECT_NEAR(pressure, 2700.0 * shock_speed * u, 1e-12 * pressure);
    EXPECT_NEAR(shock_speed, row.shock_speed, 1e-7 * row.shock_speed);
    EXPECT_NEAR(rho, row.density, 1e-7 * row.density);
    EXPECT_NEAR(pressure, row.pressure, 1e-7 * row.pressure);
  }
}

TEST(Tillotson, BranchesJoinContinuously) {
  const TillotsonParameters basalt;
  const auto pressure = [&](double rho, double e) { return evaluate_eos(basalt, rho, e).pressure; };
  for (const double e : {4.72e6, 1e7, 1.82e7, 3e7})
    EXPECT_NEAR(pressure(2700.0 * (1.0 - 1e-12), e), pressure(2700.0, e), 1e-10 * pressure(2700.0, e));
  for (const double rho : {2600.0, 1000.0, 10.0})
    for (const double e : {basalt.Eiv, basalt.Ecv})
      EXPECT_NEAR(pressure(rho, e * (1.0 + 1e-12)), pressure(rho, e * (1.0 - 1e-12)),
                  1e-9 * std::abs(pressure(rho, e)));
}

TEST(Tillotson, SmallCompressionHasNoCancellation) {
  // P = A mu + O(mu^2) at E = 0; forming eta - 1 from a rounded eta would lose half the digits of float.
  const auto k = make_tillotson_constants<float>({});
  for (const float j : {-1e-7F, -1e-6F, -1e-5F, 1e-6F}) {
    const double exact = evaluate_eos({}, 2700.0 / (1.0 + double(j)), 0.0).pressure;
    EXPECT_NEAR(double(tillotson_pressure(k, j, 0.0F)), exact, 3e-7 * std::abs(exact));
  }
}

template <class R>
void expect_finite_everywhere() {
  const auto k = make_tillotson_constants<R>({});
  std::mt19937_64 engine(7);
  std::uniform_real_distribution<double> log_density(std::log(1e-3), std::log(1e5)), energy(-1e9, 1e9);
  for (int i = 0; i < 200000; ++i) {
    const double rho = std::exp(log_density(engine));
    const R j = R((2700.0 - rho) / rho), e = R(energy(engine));
    ASSERT_TRUE(std::isfinite(tillotson_pressure(k, j, e))) << rho << " " << double(e);
    ASSERT_TRUE(std::isfinite(tillotson_sound_speed_squared(k, compression_from_volume(j), e))) << rho;
  }
}
TEST(Tillotson, FiniteForAnyDensityAndEnergyInDouble) { expect_finite_everywhere<double>(); }
TEST(Tillotson, FiniteForAnyDensityAndEnergyInFloat) { expect_finite_everywhere<float>(); }

TEST(Tillotson, NegativeEnergyCountsAsZeroAlsoAtTheSingularity) {
  const TillotsonParameters basalt;
  const double eta = 1e-3;
  EXPECT_EQ(evaluate_eos(basalt, 2700.0 * eta, -basalt.E0 * eta * eta).pressure,
            evaluate_eos(basalt, 2700.0 * eta, 0.0).pressure);
}

TEST(Tillotson, VapourLanesDoNotDisturbTheOthers) {
  using P = Pack<double, 8>;
  const auto k = make_tillotson_constants<double>({});
  P j, e;
  for (int i = 0; i < 8; ++i) {
    j.set(i, 2700.0 / kCheckPoints[i + 4].density - 1.0);
    e.set(i, kCheckPoints[i + 4].energy);
  }
  const P pressure = tillotson_pressure(k, j, e);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(pressure[i], tillotson_pressure(k, j[i], e[i]));
}

TEST(Tillotson, RefusesMeaninglessInput) {
  EXPECT_THROW(evaluate_eos({}, 0.0, 0.0), breccia::UsageError);
  EXPECT_THROW(evaluate_eos({}, std::nan(""), 0.0), breccia::UsageError);
  EXPECT_THROW(evaluate_eos({}, 2700.0, std::nan("")), breccia::UsageError);
}

}  // namespace

// Damage growth of a single element, principal strains, and Wilkins viscosity.
#include "material/damage.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "material/constitutive.hpp"
#include "random_tensors.hpp"

namespace {

using namespace breccia::material;
using namespace breccia::test;
using breccia::MaterialParameters;

// Particle of the paper's run: 47324 in a sphere of 50 km.
const double kParticleVolume = 4.0 / 3.0 * breccia::kPi * std::pow(50.0e3, 3) / 47324.0;

TEST(Damage, CrackGrowthRateOfThePaper) {
  // c_g = 1837.336 m/s over R_s = 1382.3 m.
  const double rate = crack_growth_rate(MaterialParameters{}, kParticleVolume);
  EXPECT_NEAR(rate, 1837.336 / 1382.3, 1e-4);
  // The kernels scale the constant of a material by the mass of the particle.
  const auto k = make_constants<double>({}, {}, 2500.0);
  EXPECT_NEAR(k.crack_growth / std::cbrt(2700.0 * kParticleVolume), rate, 1e-12 * rate);
}

// Strain rises as rate * t; with the flaws known, D^(1/3) = c_g/R_s sum_j (t - eps_j / rate)+ until D = n_act / n_tot.
double largest_error_of_single_element(double step) {
  const std::vector<double> thresholds{2e-6, 3e-6, 4.5e-6, 6e-6};
  const double rate = 1e-6, growth = 0.1;  // [1/s]; slow enough for the cap to bind at D = 1 only
  double root = 0.0, worst = 0.0;
  for (double time = 0.0; time < 12.0; time += step) {
    const double strain = rate * (time + step);
    const auto active = double(
        std::count_if(thresholds.begin(), thresholds.end(), [&](double threshold) { return threshold < strain; }));
    root = grow_damage_root(root, active, 4.0, growth * step);
    double exact = 0.0;
    for (const double threshold : thresholds) exact += growth * std::max(time + step - threshold / rate, 0.0);
    worst = std::max(worst, std::abs(root - std::min(exact, 1.0)));
  }
  EXPECT_EQ(root, 1.0);
  return worst;
}

TEST(Damage, SingleElementFollowsTheClosedFormToFirstOrder) {
  // A flaw becomes active up to one step early: at most four flaws times growth times step.
  for (const double step : {0.1, 0.01, 0.001})
    EXPECT_LE(largest_error_of_single_element(step), 4.0 * 0.1 * step * 1.01);
}

TEST(Damage, IsCappedByTheShareOfActiveFlawsAndNeverHeals) {
  EXPECT_NEAR(std::pow(grow_damage_root(0.0, 1.0, 8.0, 1e6), 3), 0.125, 1e-15);
  EXPECT_EQ(grow_damage_root(0.0, 8.0, 8.0, 1e6), 1.0);  // one huge step (hard case 20)
  EXPECT_EQ(grow_damage_root(0.7, 0.0, 8.0, 1.0), 0.7);  // unloaded
  EXPECT_EQ(grow_damage_root(0.9, 1.0, 8.0, 1.0), 0.9);  // damaged from the start beyond its flaws
  EXPECT_EQ(grow_damage_root(0.5F, 3.0F, 11.0F, 0.0F), 0.5F);
}

TEST(Damage, PrincipalStrainIsTheLargestLogStretch) {
  std::mt19937_64 engine(1);
  for (const double size : {1e-7, 1e-5, 1e-2, 0.5})
    for (int i = 0; i < 200; ++i) {
      const Eigen::Matrix3d f = Eigen::Matrix3d::Identity() + random_matrix(engine, size);
      const Eigen::JacobiSVD<Eigen::Matrix3d> svd(f);
      const double exact = std::log(svd.singularValues()(0));
      // F F^T - I without the cancellation of forming 1 + small.
      const Eigen::Matrix3d h = f - Eigen::Matrix3d::Identity();
      const Eigen::Matrix3d total = h + h.transpose() + h * h.transpose();
      State<double> d{};
      d.total = to_sym3<double>(total);
      State<float> s{};
      s.total = to_sym3<float>(total);
      // sqrt(epsilon) where the two largest stretches nearly coincide.
      EXPECT_NEAR(principal_strain(d), exact, 1e-7 * total.norm());
      EXPECT_NEAR(double(principal_strain(s)), exact, 1e-3 * total.norm());
    }
}

TEST(Viscosity, WilkinsPressureInCompressionOnly) {
  const auto k = make_viscosity_constants<double>(MaterialParameters{}, 2500.0);
  // q = rho c0 dx |tr d| + 2 rho dx^2 (tr d)^2 with rho0: 2.1e5 Pa at 1e-5 1/s.
  const double c0 = std::sqrt(2.67e10 / 2700.0);
  for (const double rate : {1e-5, 1e-3, 0.1}) {
    const double q = 2700.0 * (c0 * rate * 2500.0 + 2.0 * rate * rate * 2500.0 * 2500.0);
    EXPECT_NEAR(viscous_kirchhoff_pressure(k, -rate), q, 1e-12 * q);
    EXPECT_EQ(viscous_kirchhoff_pressure(k, rate), 0.0);
  }
  EXPECT_NEAR(viscous_kirchhoff_pressure(k, -1e-5), 2.1e5, 5e3);
}

}  // namespace

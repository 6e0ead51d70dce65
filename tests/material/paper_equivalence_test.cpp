// The stored form (E, J - 1, T) against the paper's (F_e, F_p): the same model, in double and in mixed precision.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "material_point.hpp"
#include "paper_reference.hpp"

namespace {

using namespace breccia;
using namespace breccia::material;
using namespace breccia::test;
using Eigen::Matrix3d;

RuntimeEffects cold_without_viscosity() {
  RuntimeEffects fx;
  fx.energy = fx.viscosity = false;
  return fx;
}

// Random velocity gradients that change every 200 steps, J held near 1 - 2e-4, elastic to fully plastic.
TEST(PaperEquivalence, RandomVelocityGradientsInDouble) {
  std::mt19937_64 engine(12345);
  std::normal_distribution<double> normal;
  for (const double amplitude : {1e-6, 1e-5, 1e-4, 1e-3}) {
    double stress = 0.0, volume = 0.0, strain = 0.0, yielding = 0.0;
    for (int particle = 0; particle < 12; ++particle) {
      const double damage = particle < 3 ? 1.0 : particle < 6 ? 0.0 : (particle - 6) / 6.0;
      PaperParticle paper(MaterialParameters{}, damage);
      MaterialPoint<double, RuntimeEffects> point;
      point.fx = cold_without_viscosity();
      // T is dropped at D = 1; an ulp below, its strain can be compared too.
      point.state.damage_root = std::cbrt(std::min(damage, 1.0 - 1e-15));
      Matrix3d gradient;
      for (int step = 0; step < 10000; ++step) {
        if (step % 200 == 0) {
          gradient = deviator(random_matrix(engine, amplitude));
          const double pull = (-2e-4 - std::log(point.volume_ratio())) / 3.0 / (200.0 * kStep);
          for (int i = 0; i < 3; ++i) gradient(i, i) += pull + 0.015 * amplitude * normal(engine);
        }
        const auto expected = paper.step(kStep * gradient);
        const Matrix3d actual = to_eigen(point.advance(gradient));
        stress = std::max(stress, (actual - expected.kirchhoff_stress).norm());
        volume = std::max(volume, std::abs(point.volume_ratio() - expected.volume_ratio));
        strain = std::max(strain, std::abs(principal_strain(point.state) - expected.principal_strain) /
                                      (1e-5 + std::abs(expected.principal_strain)));
        yielding += point.dissipation.plastic > 0.0 ? 1.0 : 0.0;
      }
    }
    // The pair loses 1e-11 of J, 0.4 Pa, to the rounding of its determinant; stresses reach 2.7e8 Pa.
    EXPECT_LT(stress, 2.0) << amplitude;
    EXPECT_LT(volume, 3e-11) << amplitude;
    EXPECT_LT(strain, 1e-6) << amplitude;
    EXPECT_GT(yielding, 0.0);
  }
}

// A resting, slowly rotating body: strain 5e-5 oscillates around a compression of 1e-4 (P = 2.7 MPa).
class RotatingBody {
 public:
  RotatingBody() : engine_(12345) {
    const Matrix3d s = random_matrix(engine_, 1.0);
    shape_ = 0.5 * (s + s.transpose()) / (0.5 * (s + s.transpose())).norm();
  }
  /// The velocity gradient of a step, rounded to float so that every precision sees the same motion.
  Matrix3d gradient(int step) {
    const double time = step * kStep, omega = 2.0 * kPi / 25.0;
    Matrix3d strain = 5e-5 * (std::sin(omega * (time + kStep)) - std::sin(omega * time)) * shape_;
    if (step < 100) strain -= 1e-4 / 3.0 / 100.0 * Matrix3d::Identity();
    strain += random_matrix(engine_, 2e-9);  // chatter of a real run
    const Matrix3d frame = rotation(3e-4 * time);
    const Matrix3d a =
        rotation(3e-4 * kStep) * (Matrix3d::Identity() + frame * strain * frame.transpose()) - Matrix3d::Identity();
    return (a / kStep).cast<float>().cast<double>();
  }

 private:
  static Matrix3d rotation(double angle) {
    return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }
  std::mt19937_64 engine_;
  Matrix3d shape_;
};

TEST(PaperEquivalence, MixedPrecisionHoldsPressureAndDeviatorOver1e5Steps) {
  RotatingBody body;
  MaterialPoint<float> mixed;
  MaterialPoint<double> reference;
  double pressure = 0.0, deviatoric = 0.0, strain = 0.0, energy = 0.0;
  for (int step = 0; step < 100000; ++step) {
    const Matrix3d gradient = body.gradient(step);
    const Matrix3d actual = to_eigen(mixed.advance(gradient));
    const Matrix3d exact = to_eigen(reference.advance(gradient));
    pressure = std::max(pressure, std::abs(actual.trace() - exact.trace()) / 3.0);
    deviatoric = std::max(deviatoric, (deviator(actual) - deviator(exact)).norm());
    strain = std::max(strain, std::abs(double(principal_strain(mixed.state)) - principal_strain(reference.state)));
    energy = std::max(energy, std::abs(double(mixed.state.energy.value()) - reference.state.energy.value()));
  }
  ASSERT_GT(reference.state.kirchhoff_pressure, 2.0e6);
  // Increments of 1.5e-6 rounded to 6e-8 of themselves walk to 3e-11 in J - 1 over the run, about 1 Pa; without the
  // carried remainder the sum itself would round to 7e-12 at every step and walk to 50 Pa.
  EXPECT_LT(pressure, 10.0);
  // Entries of 1e-4 rounded to 1e-11 at every step walk to 3e-9 at most, times 2 mu.
  EXPECT_LT(deviatoric, 500.0);
  EXPECT_LT(strain, 5.0e-9);  // flaws open at 2.6e-6 and above
  EXPECT_LT(energy, 3.0e-4);  // dP/dE = 5400 Pa per J/kg
}

// The same motion against the paper's pair in double: our double form has no drift of its own.
TEST(PaperEquivalence, RotatingBodyInDouble) {
  RotatingBody body;
  PaperParticle paper(MaterialParameters{}, 0.0);
  MaterialPoint<double, RuntimeEffects> point;
  point.fx = cold_without_viscosity();
  double stress = 0.0;
  for (int step = 0; step < 20000; ++step) {
    const Matrix3d gradient = body.gradient(step);
    const auto expected = paper.step(kStep * gradient);
    stress = std::max(stress, (to_eigen(point.advance(gradient)) - expected.kirchhoff_stress).norm());
  }
  EXPECT_LT(stress, 2.0);
}

}  // namespace

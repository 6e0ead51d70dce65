// The paper's constitutive update as printed: the pair (F_e, F_p), singular values, principal Hencky strains. Slow,
// plain, and only for tests. Cold equation of state (E = 0), no viscosity, defaults of physics.md 4.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "breccia/material_parameters.hpp"

namespace breccia::test {

class PaperParticle {
 public:
  PaperParticle(const MaterialParameters& material, double damage) : material_(material), damage_(damage) {}

  struct Result {
    Eigen::Matrix3d kirchhoff_stress;
    double volume_ratio, kirchhoff_pressure, principal_strain;
  };

  /// One step with A = dt * velocity gradient.
  Result step(const Eigen::Matrix3d& a) {
    elastic_ = (Eigen::Matrix3d::Identity() + a) * elastic_;
    const Eigen::Matrix3d total = elastic_ * plastic_;
    Result result;
    result.volume_ratio = total.determinant();
    result.principal_strain = std::log(Eigen::JacobiSVD<Eigen::Matrix3d>(total).singularValues()(0));
    const double mu = 1.0 / result.volume_ratio - 1.0;
    result.kirchhoff_pressure = result.volume_ratio * (material_.eos.A * mu + material_.eos.B * mu * mu);
    if (result.kirchhoff_pressure < 0.0) result.kirchhoff_pressure *= 1.0 - damage_;

    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(elastic_, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Matrix3d& u = svd.matrixU();
    const Eigen::Matrix3d& v = svd.matrixV();
    const Eigen::Vector3d trial = svd.singularValues().array().log();
    const Eigen::Vector3d returned = return_map(trial, result.kirchhoff_pressure);
    elastic_ = u * returned.array().exp().matrix().asDiagonal() * v.transpose();
    plastic_ = v * (trial - returned).array().exp().matrix().asDiagonal() * v.transpose() * plastic_;
    const Eigen::Vector3d deviator = returned.array() - returned.mean();
    result.kirchhoff_stress = u * (2.0 * material_.shear_modulus * deviator).asDiagonal() * u.transpose() -
                              result.kirchhoff_pressure * Eigen::Matrix3d::Identity();
    return result;
  }

 private:
  Eigen::Vector3d return_map(const Eigen::Vector3d& trial, double& kirchhoff_pressure) const {
    const double two_mu = 2.0 * material_.shear_modulus;
    const double cohesion = std::sqrt(2.0) * material_.strength.cohesion;
    const double range = std::sqrt(2.0) * (material_.strength.limit - material_.strength.cohesion);
    const double intact_slope = 3.0 * alpha(material_.strength.intact_friction_angle);
    const double damaged_slope = 3.0 * alpha(material_.strength.damaged_friction_angle);
    const double x = intact_slope * kirchhoff_pressure;
    const double intact = cohesion + (x > 0.0 ? x / (1.0 + x / range) : x);
    const double damaged = std::min(damaged_slope * kirchhoff_pressure, intact);
    const double yield = ((1.0 - damage_) * intact + damage_ * damaged) / two_mu;
    if (yield <= 0.0) {
      kirchhoff_pressure = -(1.0 - damage_) * cohesion / ((1.0 - damage_) * intact_slope + damage_ * damaged_slope);
      return Eigen::Vector3d::Zero();
    }
    const Eigen::Vector3d deviator = trial.array() - trial.mean();
    const double norm = deviator.norm();
    if (norm <= yield) return trial;
    return trial - (norm - yield) * deviator / norm;
  }

  static double alpha(double angle) { return std::sqrt(2.0 / 3.0) * 2.0 * std::sin(angle) / (3.0 - std::sin(angle)); }

  MaterialParameters material_;
  double damage_;
  Eigen::Matrix3d elastic_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d plastic_ = Eigen::Matrix3d::Identity();
};

}  // namespace breccia::test

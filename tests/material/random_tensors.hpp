// Random and rotated tensors for tests, and conversions to Eigen.
#pragma once

#include <Eigen/Dense>
#include <random>

#include "breccia/linalg.hpp"

namespace breccia::test {

inline Eigen::Matrix3d random_matrix(std::mt19937_64& engine, double amplitude) {
  std::normal_distribution<double> normal(0.0, amplitude);
  Eigen::Matrix3d m;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m(i, j) = normal(engine);
  return m;
}

inline Eigen::Matrix3d random_rotation(std::mt19937_64& engine) {
  const Eigen::HouseholderQR<Eigen::Matrix3d> qr(random_matrix(engine, 1.0));
  Eigen::Matrix3d q = qr.householderQ();
  if (q.determinant() < 0.0) q.col(0) = -q.col(0).eval();
  return q;
}

inline Eigen::Matrix3d deviator(const Eigen::Matrix3d& m) { return m - m.trace() / 3.0 * Eigen::Matrix3d::Identity(); }

/// Traceless symmetric tensor with the given eigenvalues x, y, -(x + y) in random directions.
inline Eigen::Matrix3d random_traceless(std::mt19937_64& engine, double x, double y) {
  const Eigen::Matrix3d q = random_rotation(engine);
  return q * Eigen::Vector3d(x, y, -(x + y)).asDiagonal() * q.transpose();
}

template <class T>
Mat3<T> to_mat3(const Eigen::Matrix3d& m) {
  return {T(m(0, 0)), T(m(0, 1)), T(m(0, 2)), T(m(1, 0)), T(m(1, 1)), T(m(1, 2)), T(m(2, 0)), T(m(2, 1)), T(m(2, 2))};
}
template <class T>
Sym3<T> to_sym3(const Eigen::Matrix3d& m) {
  return {T(m(0, 0)), T(m(1, 1)), T(m(2, 2)), T(m(0, 1)), T(m(0, 2)), T(m(1, 2))};
}
template <class T>
Dev3<T> to_dev3(const Eigen::Matrix3d& m) {
  return {T(m(0, 0)), T(m(1, 1)), T(m(0, 1)), T(m(0, 2)), T(m(1, 2))};
}
template <class T>
Eigen::Matrix3d to_eigen(const Sym3<T>& s) {
  Eigen::Matrix3d m;
  m << double(s.xx), double(s.xy), double(s.xz), double(s.xy), double(s.yy), double(s.yz), double(s.xz), double(s.yz),
      double(s.zz);
  return m;
}
template <class T>
Eigen::Matrix3d to_eigen(const Dev3<T>& d) {
  return to_eigen(Sym3<T>{d.xx, d.yy, d.zz(), d.xy, d.xz, d.yz});
}

/// Applies f to the eigenvalues of a symmetric tensor.
template <class F>
Eigen::Matrix3d spectral_map(const Eigen::Matrix3d& m, F f) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(m);
  return solver.eigenvectors() * solver.eigenvalues().unaryExpr(f).asDiagonal() * solver.eigenvectors().transpose();
}

}  // namespace breccia::test

// Largest eigenvalue and Jacobi decomposition against Eigen.
#include "material/eigen.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "random_tensors.hpp"

namespace {

using namespace breccia::material;
using namespace breccia::test;
using breccia::Sym3;
using Eigen::Matrix3d;

template <class R>
class SymmetricEigenproblem : public ::testing::Test {};
using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(SymmetricEigenproblem, Reals);

TYPED_TEST(SymmetricEigenproblem, LargestEigenvalueRelativeToTheTensorAtAnySize) {
  using R = TypeParam;
  const double epsilon = double(std::numeric_limits<R>::epsilon());
  std::mt19937_64 engine(1);
  for (const double size : {1e-9, 1e-6, 1e-3, 1.0, 1e3})
    for (int i = 0; i < 2000; ++i) {
      const Matrix3d q = random_rotation(engine), raw = random_matrix(engine, size);
      const Sym3<R> a = to_sym3<R>(q * raw.diagonal().asDiagonal() * q.transpose());
      const Eigen::Vector3d exact = Eigen::SelfAdjointEigenSolver<Matrix3d>(to_eigen(a)).eigenvalues();
      // The cubic amplifies rounding by the norm over the gap of the two largest eigenvalues, at most to sqrt(epsilon).
      const double norm = exact.norm();
      const double amplification = std::min(norm / (exact(2) - exact(1) + 1e-300), 1.0 / std::sqrt(epsilon));
      EXPECT_NEAR(double(largest_eigenvalue(a)), exact(2), 4.0 * epsilon * (1.0 + amplification) * norm);
    }
}

TYPED_TEST(SymmetricEigenproblem, LargestEigenvalueOfDegenerateTensors) {
  using R = TypeParam;
  const double root = std::sqrt(double(std::numeric_limits<R>::epsilon()));
  EXPECT_EQ(double(largest_eigenvalue(Sym3<R>{})), 0.0);
  const R c = R(1e-6);
  EXPECT_NEAR(double(largest_eigenvalue(Sym3<R>{c, c, c, R(0), R(0), R(0)})), double(c), 1e-6 * double(c));
  EXPECT_NEAR(double(largest_eigenvalue(Sym3<R>{c, c, -c, R(0), R(0), R(0)})), double(c), root * double(c));
  EXPECT_NEAR(double(largest_eigenvalue(Sym3<R>{c, R(0), R(0), R(0), R(0), R(0)})), double(c), 1e-6 * double(c));
  EXPECT_NEAR(double(largest_eigenvalue(Sym3<R>{-c, R(0), R(0), R(0), R(0), R(0)})), 0.0, root * double(c));
}

TYPED_TEST(SymmetricEigenproblem, NoEigenvalueBeyondALimitIsMissed) {
  using R = TypeParam;
  const double epsilon = double(std::numeric_limits<R>::epsilon());
  std::mt19937_64 engine(3);
  int passed_over = 0;
  for (const double size : {1e-6, 1.0})
    for (int i = 0; i < 2000; ++i) {
      const Matrix3d raw = random_matrix(engine, size);
      const Sym3<R> a = to_sym3<R>(0.5 * (raw + raw.transpose()));
      const Matrix3d exact = to_eigen(a);
      const double largest = Eigen::SelfAdjointEigenSolver<Matrix3d>(exact).eigenvalues()(2);
      // Rounding of the mean and of the squares, a few ulp of the norm.
      const double rounding = 20.0 * epsilon * exact.norm();
      EXPECT_TRUE(eigenvalue_may_exceed(a, R(largest - rounding)));
      EXPECT_TRUE(eigenvalue_may_exceed(a, R(-2.0 * exact.norm())));
      EXPECT_FALSE(eigenvalue_may_exceed(a, R(largest + deviator(exact).norm() / std::sqrt(6.0) + rounding)));
      passed_over += eigenvalue_may_exceed(a, R(largest + 0.9 * deviator(exact).norm() / std::sqrt(6.0))) ? 0 : 1;
    }
  EXPECT_GT(passed_over, 1000) << "the bound is no use";
}

TYPED_TEST(SymmetricEigenproblem, JacobiRebuildsTheTensorFromOrthonormalVectors) {
  using R = TypeParam;
  const double epsilon = double(std::numeric_limits<R>::epsilon());
  std::mt19937_64 engine(2);
  for (int i = 0; i < 3000; ++i) {
    // Every third one with two equal eigenvalues, every seventh diagonal.
    Eigen::Vector3d values = random_matrix(engine, 0.3).diagonal();
    if (i % 3 == 0) values(1) = values(0);
    const Matrix3d q = i % 7 == 0 ? Matrix3d(Matrix3d::Identity()) : random_rotation(engine);
    const Sym3<R> a = to_sym3<R>(q * values.asDiagonal() * q.transpose());
    const SymmetricEigen<R> s = symmetric_eigen(a);
    Matrix3d v, d = Matrix3d::Zero();
    for (int k = 0; k < 3; ++k) {
      v.col(k) << double(s.vector[k].x), double(s.vector[k].y), double(s.vector[k].z);
      d(k, k) = double(s.value[k]);
    }
    EXPECT_LE((v.transpose() * v - Matrix3d::Identity()).norm(), 30.0 * epsilon);
    EXPECT_LE((v * d * v.transpose() - to_eigen(a)).norm(), 30.0 * epsilon * values.norm());
  }
}

}  // namespace

// The copies of the pair kernel for different instruction sets agree with each other to rounding.
#include <gtest/gtest.h>

#include <numeric>

#include "breccia/isa.hpp"
#include "gravity/pair_kernel.hpp"
#include "gravity/points.hpp"
#include "plain_sum.hpp"

namespace breccia::gravity {
namespace {

template <class Real>
using Kernel = void (*)(const PairTask<Real>&);

// The kernels this program contains and this processor runs.
template <class Real>
std::vector<Kernel<Real>> kernels() {
  std::vector<Kernel<Real>> all;
#ifdef BRECCIA_HAVE_V2
  if (available(Isa::kV2)) all.push_back(&isa_v2::sum_pairs);
#endif
#ifdef BRECCIA_HAVE_V3
  if (available(Isa::kV3)) all.push_back(&isa_v3::sum_pairs);
#endif
#ifdef BRECCIA_HAVE_V4
  if (available(Isa::kV4)) all.push_back(&isa_v4::sum_pairs);
#endif
  all.push_back(&sum_pairs);
  return all;
}

template <class Real>
Field run(Kernel<Real> kernel, const Cloud& cloud, double softening) {
  Points<Real> points;
  points.fill({cloud.position, cloud.mass}, 1.0 / kGravitationalConstant);
  const auto size = static_cast<std::size_t>(padded(points.arrays().count));
  std::vector<double> sums[4];
  for (auto& sum : sums) sum.assign(size, 0.0);
  kernel({.targets = points.arrays(),
          .begin = 0,
          .end = static_cast<std::int64_t>(size),
          .sources = points.arrays(),
          .same = true,
          .softening_squared = static_cast<Real>(softening * softening),
          .acceleration = {sums[0].data(), sums[1].data(), sums[2].data()},
          .potential = sums[3].data()});
  Field field;
  for (std::size_t i = 0; i < cloud.position.size(); ++i) {
    field.acceleration.push_back({sums[0][i], sums[1][i], sums[2][i]});
    field.potential.push_back(sums[3][i]);
  }
  return field;
}

template <class Real>
void expect_agreement(double tolerance) {
  Cloud cloud;
  std::mt19937_64 random(3);
  // Masses of order 1 in units of 1/G, as the direct sum scales them: q^3 of a metre must not leave the range of float.
  add_ball(cloud, 777, {0, 0, 0}, 5e4, random);
  for (double& m : cloud.mass) m /= 3e13;
  for (const double softening : {0.0, 125.0}) {
    const Field plain = plain_sum(cloud, softening);
    for (const Kernel<Real> kernel : kernels<Real>()) {
      const Field field = run(kernel, cloud, softening);
      EXPECT_LT(rms_error(field.acceleration, plain.acceleration), tolerance);
      for (std::size_t i = 0; i < field.potential.size(); ++i) {
        EXPECT_NEAR(field.potential[i] / plain.potential[i], 1.0, tolerance);
      }
    }
  }
}

// About ten roundings a pair, half an ulp each: 6e-8 in float, 1.1e-16 in double.
TEST(PairKernel, InstructionSetsAgreeInFloat) { expect_agreement<float>(5e-7); }
TEST(PairKernel, InstructionSetsAgreeInDouble) { expect_agreement<double>(1e-14); }

// One pair at 10,000 distances: no bias and no outlier in the refined reciprocal square root.
TEST(PairKernel, PairLawHoldsOverSevenDecades) {
  for (const Kernel<float> kernel : kernels<float>()) {
    for (int k = 0; k < 10000; ++k) {
      const double r = 10.0 * std::pow(10.0, 7.0 * k / 10000.0);
      const Cloud pair{{{0, 0, 0}, {r, 0, 0}}, {1.0, 1.0}};
      const Field field = run(kernel, pair, 0.0);
      ASSERT_NEAR(field.acceleration[0].x * r * r / kGravitationalConstant, 1.0, 1e-6) << r;
      ASSERT_EQ(field.acceleration[0].x, -field.acceleration[1].x) << r;
    }
  }
}

}  // namespace
}  // namespace breccia::gravity

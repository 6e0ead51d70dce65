// Parts of the particle mesh on the emulated device, on one rank and several.
#include <gtest/gtest.h>

#include <vector>

#include "cuda/body_sets.hpp"
#include "tests/cuda/mesh_cases.hpp"

namespace breccia::cuda {
namespace {

TEST(DeviceConvolutionTest, PotentialIsHosts) {
  const mpi::Comm world;
  expect_potential_is_hosts<double>(world);
  expect_potential_is_hosts<float>(world);
}

TEST(BoxGravityTest, FieldIsHostsForEveryDegreeOfTheLaw) {
  const mpi::Comm world;
  expect_box_is_hosts<double>(world);
  expect_box_is_hosts<float>(world);
}

// Bodies inside two boxes and outside of both come out by set, in their order, none lost.
TEST(BodySetsTest, BodiesAreDealtOut) {
  const Stream stream;
  constexpr unsigned n = 1000;
  std::vector<double> values(4 * n);
  for (std::size_t i = 0; i < 4 * n; ++i) values[i] = pattern(i);
  DeviceArray<double> bodies(4 * n);
  bodies.upload(values, stream);
  const double* x = bodies.data();
  const gravity::Box boxes[] = {{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}}, {{0.5, 0.5, 0.5}, {2.0, 2.0, 1.5}}};
  BodySets sets(stream);
  sets.divide({{x, x + n, x + 2 * n}, x + 3 * n, n}, boxes);
  ASSERT_EQ(sets.sets().size(), 3U);
  std::vector<unsigned> next(3, 0);
  std::vector<std::vector<unsigned>> index;
  std::vector<std::vector<double>> mass;
  for (const BodyArrays& set : sets.sets()) {
    index.emplace_back(set.count);
    mass.emplace_back(set.count);
    check(cudaMemcpyAsync(index.back().data(), set.index, set.count * sizeof(unsigned), cudaMemcpyDeviceToHost, stream),
          "index");
    check(cudaMemcpyAsync(mass.back().data(), set.mass, set.count * sizeof(double), cudaMemcpyDeviceToHost, stream),
          "mass");
  }
  check(cudaStreamSynchronize(stream), "sets");
  for (unsigned i = 0; i < n; ++i) {
    const std::size_t k = gravity::set_of({values[i], values[n + i], values[2 * n + i]}, boxes, 2);
    ASSERT_LT(next[k], index[k].size());
    EXPECT_EQ(mass[k][next[k]], values[3 * n + i]);
    EXPECT_EQ(index[k][next[k]++], i);
  }
  EXPECT_EQ(next[0] + next[1] + next[2], n);
}

}  // namespace
}  // namespace breccia::cuda

// Parts of the particle mesh on the emulated device, on one rank and several.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "cuda/body_sets.hpp"
#include "cuda/box_gravity.hpp"
#include "gravity/mesh/tree_pm.hpp"

namespace breccia::cuda {
namespace {

class DeviceStream {
 public:
  DeviceStream() { check(cudaStreamCreate(&stream_), "stream"); }
  ~DeviceStream() { (void)cudaStreamDestroy(stream_); }
  DeviceStream(const DeviceStream&) = delete;
  DeviceStream& operator=(const DeviceStream&) = delete;
  operator cudaStream_t() const { return stream_; }  // NOLINT(google-explicit-constructor)

 private:
  cudaStream_t stream_ = nullptr;
};

double pattern(std::size_t n) { return 1.0 + std::sin(0.7 * static_cast<double>(n * n % 1013)); }

// Of planes dealt out to the ranks, with transpositions between them, and of all on one: the host's convolution.
// Rounding of a transform grows as the logarithm of its length: some 1e-15 of the largest value.
TEST(DeviceConvolutionTest, PotentialIsHosts) {
  const mpi::Comm world;
  const DeviceStream stream;
  const gravity::MeshSize size{{24, 27, 25}, {42, 48, 44}};
  const gravity::Kernel kernel = gravity::mesh_kernel({.scale = 0.8, .cutoff = 3.6, .softening = 0.1});
  const std::size_t plane = 27 * 25;
  std::vector<double> expected(24 * plane);
  for (std::size_t n = 0; n < expected.size(); ++n) expected[n] = pattern(n);
  const std::vector<double> masses = expected;
  gravity::Convolution<double>(size, kernel, mpi::Comm(MPI_COMM_SELF), 1).apply(expected.data());

  DeviceConvolution<double> convolution(size, kernel, world, stream);
  const MeshPlanes<double> to = convolution.masses();
  std::vector<double> own(to.size(), 0.0);
  for (int i = to.begin; i < to.end; ++i) {
    for (int j = 0; j < 27; ++j) {
      for (int k = 0; k < 25; ++k)
        own[to.at(i, j, k)] = masses[static_cast<std::size_t>(i * 27 + j) * 25 + static_cast<std::size_t>(k)];
    }
  }
  check(cudaMemcpyAsync(to.values, own.data(), own.size() * sizeof(double), cudaMemcpyHostToDevice, stream), "masses");
  convolution.apply();
  const MeshPlanes<const double> from = convolution.potential();
  std::vector<double> found(from.size());
  check(cudaMemcpyAsync(found.data(), from.values, found.size() * sizeof(double), cudaMemcpyDeviceToHost, stream), "");
  check(cudaStreamSynchronize(stream), "potential");
  const double largest = std::abs(*std::min_element(expected.begin(), expected.end()));
  for (int i = 0; i < 24; ++i) {
    for (int j = 0; j < 27; ++j) {
      for (int k = 0; k < 25; ++k) {
        const std::size_t n = static_cast<std::size_t>(i * 27 + j) * 25 + static_cast<std::size_t>(k);
        ASSERT_NEAR(found[from.at(i, j, k)], expected[n], 1e-14 * largest) << i << " " << j << " " << k;
      }
    }
  }
  EXPECT_EQ(convolution.bytes_sent() > 0.0, world.size() > 1);
}

// Bodies inside two boxes and outside of both come out by set, in their order, none lost.
TEST(BodySetsTest, BodiesAreDealtOut) {
  const DeviceStream stream;
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

// Parts of the particle mesh on the emulated device against those of the host, on one rank and several.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "cuda/box_gravity.hpp"
#include "cuda/device_census.hpp"
#include "cuda/stream.hpp"
#include "gravity/mesh/convolution.hpp"
#include "gravity/mesh/host_census.hpp"

namespace breccia::cuda {

inline double pattern(std::size_t n) { return 1.0 + std::sin(0.7 * static_cast<double>(n * n % 1013)); }

// Of planes dealt out to the ranks, with transpositions between them, and of all on one: the host's convolution.
// Rounding of a transform grows as the logarithm of its length: some units in the last place of the largest value.
template <class Real>
void expect_potential_is_hosts(const mpi::Comm& world) {
  const Stream stream;
  const gravity::MeshSize size{{24, 27, 25}, {42, 48, 44}};
  const gravity::Kernel kernel = gravity::mesh_kernel({.scale = 0.8, .cutoff = 3.6, .softening = 0.1});
  const std::size_t plane = 27 * 25;
  std::vector<Real> expected(24 * plane);
  for (std::size_t n = 0; n < expected.size(); ++n) expected[n] = static_cast<Real>(pattern(n));
  const std::vector<Real> masses = expected;
  gravity::Convolution<Real>(size, kernel, mpi::Comm(MPI_COMM_SELF), 1).apply(expected.data());

  DeviceConvolution<Real> convolution(size, kernel, world, stream);
  const MeshPlanes<Real> to = convolution.masses();
  std::vector<Real> own(to.size(), Real(0));
  for (int i = to.begin; i < to.end; ++i) {
    for (int j = 0; j < 27; ++j) {
      for (int k = 0; k < 25; ++k)
        own[to.at(i, j, k)] = masses[static_cast<std::size_t>(i * 27 + j) * 25 + static_cast<std::size_t>(k)];
    }
  }
  check(cudaMemcpyAsync(to.values, own.data(), own.size() * sizeof(Real), cudaMemcpyHostToDevice, stream), "masses");
  convolution.apply();
  const MeshPlanes<const Real> from = convolution.potential();
  std::vector<Real> found(from.size());
  check(cudaMemcpyAsync(found.data(), from.values, found.size() * sizeof(Real), cudaMemcpyDeviceToHost, stream), "");
  check(cudaStreamSynchronize(stream), "potential");
  const double largest = std::abs(*std::min_element(expected.begin(), expected.end()));
  const double tolerance = 45.0 * std::numeric_limits<Real>::epsilon() * largest;
  for (int i = 0; i < 24; ++i) {
    for (int j = 0; j < 27; ++j) {
      for (int k = 0; k < 25; ++k) {
        const std::size_t n = static_cast<std::size_t>(i * 27 + j) * 25 + static_cast<std::size_t>(k);
        ASSERT_NEAR(found[from.at(i, j, k)], expected[n], tolerance) << i << " " << j << " " << k;
      }
    }
  }
  EXPECT_EQ(convolution.bytes_sent() > 0.0, world.size() > 1);
}

// Bodies strewn over a box that is wider than any cutoff.
struct BoxOfBodies {
  static constexpr std::size_t kCount = 300;
  static constexpr double kCell = 1e3;
  std::vector<Vec3d> position;
  std::vector<double> mass;

  BoxOfBodies() {
    for (std::size_t n = 0; n < kCount; ++n) {
      const auto at = [n](double step) {
        return 9.0 * kCell * (step * static_cast<double>(n) - std::floor(step * static_cast<double>(n)));
      };
      position.push_back({at(0.8191725), at(0.6710436), at(0.5497005)});
      mass.push_back(1e12 * (1.0 + 0.5 * pattern(n)));
    }
  }
  [[nodiscard]] static gravity::BoxSettings settings(double cutoff) {
    return {.box = {{0.0, 0.0, 0.0}, {9.0 * kCell, 9.0 * kCell, 9.0 * kCell}},
            .cell = kCell,
            .spacing = 1.3 * kCell,
            .split = {.scale = 0.8, .cutoff = 0.8 * cutoff},
            .mass_unit = 1e12};
  }
};

// The same on a device.
class BodiesOnDevice {
 public:
  BodiesOnDevice(const BoxOfBodies& bodies, cudaStream_t stream) : values_(4 * BoxOfBodies::kCount) {
    std::vector<double> values;
    for (const Vec3d p : bodies.position) values.push_back(p.x);
    for (const Vec3d p : bodies.position) values.push_back(p.y);
    for (const Vec3d p : bodies.position) values.push_back(p.z);
    values.insert(values.end(), bodies.mass.begin(), bodies.mass.end());
    values_.upload(values, stream);
  }
  [[nodiscard]] BodyArrays arrays() const {
    constexpr std::size_t n = BoxOfBodies::kCount;
    const double* x = values_.data();
    return {{x, x + n, x + 2 * n}, x + 3 * n, static_cast<unsigned>(n)};
  }

 private:
  DeviceArray<double> values_;
};

template <class Real>
std::vector<Vec3d> box_field_of_host(const BoxOfBodies& bodies, const gravity::BoxSettings& settings) {
  std::vector<Vec3d> acceleration(BoxOfBodies::kCount);
  std::vector<double> work(BoxOfBodies::kCount);
  const std::vector<std::uint8_t> set(BoxOfBodies::kCount, 1);
  gravity::Stats stats;
  gravity::BoxField<Real>(mpi::Comm(MPI_COMM_SELF), 1)
      .add_to({bodies.position, bodies.mass}, set, 1, settings, {acceleration, {}, work}, stats);
  return acceleration;
}

// Of the bodies of this rank, which are as many as those of any other, [component][body].
template <class Real>
std::vector<double> box_field_of_device(const BoxOfBodies& bodies, const gravity::BoxSettings& settings,
                                        const mpi::Comm& world) {
  const Stream stream;
  const BodiesOnDevice on_device(bodies, stream);
  const auto own = static_cast<unsigned>(BoxOfBodies::kCount) / static_cast<unsigned>(world.size());
  DeviceArray<double> acceleration(std::size_t{3} * own);
  acceleration.fill_bytes(0, stream);
  gravity::Stats stats;
  BoxGravity<Real>(world, stream)
      .add_field(on_device.arrays(), settings, own * static_cast<unsigned>(world.rank()), own, acceleration.data(),
                 stats);
  return acceleration.download(std::size_t{3} * own, stream);
}

// Of blocks that are full.
inline void expect_counts_are_hosts() {
  const Stream stream;
  const BoxOfBodies bodies;
  const BodiesOnDevice on_device(bodies, stream);
  DeviceCensus device(stream);
  device.take(on_device.arrays(), *std::max_element(bodies.mass.begin(), bodies.mass.end()));
  gravity::HostCensus host({bodies.position, bodies.mass}, 1);
  device.divide(3.0 * BoxOfBodies::kCell);
  host.divide(3.0 * BoxOfBodies::kCell);
  std::vector<gravity::BlockIndex> full;
  for (const gravity::BlockCount& b : device.crowded(8)) full.push_back(b.index);
  ASSERT_FALSE(full.empty());
  EXPECT_EQ(device.counts(full), host.counts(full));
}

// Mesh and near pairs of a box, with a short-range law of each degree that there is a kernel for.
template <class Real>
void expect_box_is_hosts(const mpi::Comm& world) {
  const BoxOfBodies bodies;
  for (const auto& [cutoff, degree] : {std::pair(4.5, 8), std::pair(5.5, 10), std::pair(6.5, 12)}) {
    const gravity::BoxSettings settings = BoxOfBodies::settings(cutoff);
    ASSERT_EQ(gravity::fit_short_range<Real>(settings.split).degree, degree);
    const std::vector<Vec3d> expected = box_field_of_host<Real>(bodies, settings);
    const std::vector<double> found = box_field_of_device<Real>(bodies, settings, world);
    double squares = 0.0;
    const std::size_t own = found.size() / 3;
    for (std::size_t i = 0; i < own; ++i) {
      const Vec3d a = expected[own * static_cast<std::size_t>(world.rank()) + i];
      const Vec3d d = Vec3d{found[i], found[own + i], found[2 * own + i]} - a;
      squares += dot(d, d) / dot(a, a);
    }
    EXPECT_LE(std::sqrt(squares / static_cast<double>(own)), sizeof(Real) == 8 ? 1e-12 : 3e-6) << degree;
  }
}

}  // namespace breccia::cuda

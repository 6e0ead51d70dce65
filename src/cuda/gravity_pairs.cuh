// Pairs of particles on the device: a thread is a target, sources come in tiles of shared memory. Real sums over a tile
// go to double sums, as on the host.
#pragma once

#include "breccia/linalg.hpp"
#include "cuda/gravity_kernels.hpp"
#include "gravity/pair_law.hpp"

namespace breccia::cuda {

__device__ __forceinline__ float inverse_root(float x) { return rsqrtf(x); }
__device__ __forceinline__ double inverse_root(double x) { return rsqrt(x); }

/// A coordinate as a sum of two floats, or one double: see gravity/points.hpp.
template <class Real>
struct Coordinate;
template <>
struct Coordinate<float> {
  float high, low;
  __device__ __forceinline__ void set(double x) {
    high = static_cast<float>(x);
    low = static_cast<float>(x - static_cast<double>(high));
  }
  __device__ __forceinline__ float minus(const Coordinate& b) const { return (high - b.high) + (low - b.low); }
};
template <>
struct Coordinate<double> {
  double value;
  __device__ __forceinline__ void set(double x) { value = x; }
  __device__ __forceinline__ double minus(const Coordinate& b) const { return value - b.value; }
};

template <class Real>
struct alignas(16) PointMass {  // two loads of 16 bytes
  Coordinate<Real> position[3];
  Real mass;
  __device__ __forceinline__ void set(Vec3d x, double m) {
    position[0].set(x.x);
    position[1].set(x.y);
    position[2].set(x.z);
    mass = static_cast<Real>(m);
  }
};

template <class Real>
struct PairTile {
  PointMass<Real> source[kTileSources];
};

/// Sum of m d q^3 over the first `count` sources. A target among them adds nothing: d = 0, and q stays finite.
template <class Real>
__device__ __forceinline__ Vec3d sum_of_tile(const PairTile<Real>& tile, unsigned count, const PointMass<Real>& target,
                                             Real softening_squared) {
  Vec3<Real> sum{};
  for (unsigned j = 0; j < count; ++j) {
    const PointMass<Real>& s = tile.source[j];
    const Vec3<Real> d{s.position[0].minus(target.position[0]), s.position[1].minus(target.position[1]),
                       s.position[2].minus(target.position[2])};
    const Real r2 = dot(d, d) + softening_squared;
    const Real q = r2 <= gravity::kCoincidentPair<Real> ? Real(0) : inverse_root(r2);
    sum += (s.mass * gravity::newton_pair(q).force) * d;
  }
  return {static_cast<double>(sum.x), static_cast<double>(sum.y), static_cast<double>(sum.z)};
}

}  // namespace breccia::cuda

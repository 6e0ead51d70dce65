// Pairs of particles on the device: a thread is a target, sources come in tiles of shared memory. Real sums over a tile
// go to double sums, as on the host.
#pragma once

#include "breccia/linalg.hpp"
#include "breccia/math.hpp"
#include "cuda/gravity_kernels.hpp"
#include "gravity/pair_law.hpp"

namespace breccia::cuda {

__device__ __forceinline__ float inverse_root(float x) { return rsqrtf(x); }
__device__ __forceinline__ double inverse_root(double x) { return rsqrt(x); }

template <class Real>
__device__ __forceinline__ Vec3<Real> to_real(Vec3d x) {
  return {static_cast<Real>(x.x), static_cast<Real>(x.y), static_cast<Real>(x.z)};
}
template <class Real>
__device__ __forceinline__ Vec3d to_double(Vec3<Real> x) {
  return {static_cast<double>(x.x), static_cast<double>(x.y), static_cast<double>(x.z)};
}

/// A source as seen from an origin near the sources of its tile: what is left of a coordinate in Real is exact to the
/// rounding of distances in the tile, and of the distance to a target elsewhere. One load.
template <class Real>
struct alignas(4 * sizeof(Real)) PointMass {
  Vec3<Real> position;
  Real mass;
};

template <class Real>
struct PairTile {
  PointMass<Real> source[kTileSources];
};

/// Of the direct sum.
template <class Real>
struct DirectTile {
  PairTile<Real> pairs;
  Vec3<Real> rest[kTileSources];  ///< what rounding left of the sources' positions
};

/// The square of a softening length [m2], enough of it that q^3 of a particle and itself stays finite.
template <class Real>
BRECCIA_HD Real squared_softening(double softening) {
  return max(static_cast<Real>(softening * softening), gravity::kCoincidentPair<Real>);
}

/// Sum of m d q^3 over the first `count` sources for a target seen from the same origin. A target among them adds
/// nothing, as d = 0.
template <class Real>
__device__ __forceinline__ Vec3d sum_of_tile(const PairTile<Real>& tile, unsigned count, Vec3<Real> target,
                                             Real softening_squared) {
  Vec3<Real> sum{};
  BRECCIA_UNROLL(8)
  for (unsigned j = 0; j < count; ++j) {
    const PointMass<Real> s = tile.source[j];
    const Vec3<Real> d = s.position - target;
    sum += (s.mass * gravity::newton_pair(inverse_root(dot(d, d) + softening_squared)).force) * d;
  }
  return to_double(sum);
}

}  // namespace breccia::cuda

// What the warps that sum near pairs keep in shared memory: sources in reach of their targets.
#pragma once

#include "cuda/mesh_kernels.hpp"

namespace breccia::cuda {

inline constexpr unsigned kNearThreads = 128;
/// A list is worked off from so many sources on.
inline constexpr unsigned kListed = 96;

/// A source in coordinates from the centre of the target cluster.
template <class Real>
struct alignas(16) NearSource {
  Vec3<Real> position;
  Real mass;
};
template <class Real>
struct NearShared {
  NearSource<Real> list[kNearThreads / kClusterBodies][kListed + kClusterBodies];
};

}  // namespace breccia::cuda

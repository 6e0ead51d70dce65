// How much memory of a device an evaluation of gravity takes, from counts alone: for the message before a run, and for
// a plan where there is no device.
#pragma once

#include <cstdint>
#include <vector>

#include "breccia/scene.hpp"
#include "gravity/mesh/green.hpp"

namespace breccia::cuda {

/// A box that gets a mesh.
struct BoxLoad {
  std::uint64_t particles = 0;  ///< of all ranks
  gravity::MeshSize size{};
};

/// What is to be summed.
struct GravityLoad {
  std::uint64_t own = 0;  ///< particles of this rank
  std::uint64_t all = 0;  ///< of all ranks, whose positions every device holds
  int ranks = 1;
  bool seeks_boxes = false;      ///< as the particle mesh does, and `auto` where the choice needs it
  double opening = 1.2e-4;       ///< gravity::opening_for()
  std::vector<BoxLoad> boxes{};  ///< of the particle mesh
};

/// All arrays of CudaGravity<Real> and of what it calls, cuFFT's work area included [bytes]. For kDirect, kTree and
/// kTreePm. What trees take follows from counts that were measured (gravity_memory.cpp): trees of matter unlike any of
/// it may take more.
template <class Real>
std::uint64_t bytes_for_gravity(GravityMethod method, const GravityLoad& load);

}  // namespace breccia::cuda

// What all ways of summing gravity on the device need before and after: predicted positions, extremes, net force, and
// the accelerations that particles hold.
#pragma once

#include "breccia/linalg.hpp"
#include "cuda/device_runtime.hpp"
#include "cuda/particle_view.hpp"
#include "grid/layout.hpp"

namespace breccia::cuda {

/// Point masses in device memory, one array per component [m, kg].
struct BodyArrays {
  const double* position[3] = {nullptr, nullptr, nullptr};
  const double* mass = nullptr;
  unsigned count = 0;
  const unsigned* index = nullptr;  ///< place of each among the bodies of all ranks; null: these are they

  [[nodiscard]] BRECCIA_HD Vec3d at(unsigned i) const { return {position[0][i], position[1][i], position[2][i]}; }
  [[nodiscard]] BRECCIA_HD unsigned place(unsigned i) const { return index == nullptr ? i : index[i]; }
};

/// Where positions repeat: lengths of 0 do not [m].
struct Period {
  Vec3d start{};
  Vec3d length{};
};

/// The particles of this rank as the engine holds them, and for when they are wanted.
template <class Real>
struct PredictArguments {
  ParticleView<Real> particles;
  const grid::BlockKey* block_keys = nullptr;  ///< [count] blocks that the nodes are relative to
  unsigned count = 0;
  double cell = 0;  ///< [m]
  double time = 0;  ///< how far to drift [s]
  Period period;
};
/// to[4][count] := x + time v [m] and mass [kg].
template <class Real>
void launch_predict(const PredictArguments<Real>& a, double* to, cudaStream_t stream);

/// Sources of a tile, which lie in shared memory at a time, and threads of a block of targets.
inline constexpr unsigned kTileSources = 128;

/// Sums and extremes of `count` bodies leave the device as one entry for each of so many thread blocks: equal on every
/// device, and one for no body.
inline constexpr unsigned kReducerThreads = 128;
inline constexpr unsigned kMostReducers = 128;
constexpr unsigned reducers(unsigned count) {
  const unsigned blocks = count / kReducerThreads + 1;
  return blocks < kMostReducers ? blocks : kMostReducers;
}

/// Largest x, y, z, -x, -y, -z and mass of what a thread block saw; -infinity where that is nothing.
struct Extremes {
  double of[7];
};
void launch_extremes(const BodyArrays& bodies, Extremes* of_block, cudaStream_t stream);

/// Of what a thread block saw: sum(m a) and sum(m |a|).
struct NetForce {
  double of[4];
};
/// `acceleration` [3][count] of the particles whose masses are given.
template <class Real>
void launch_net_force(const double* acceleration, const Real* mass, unsigned count, NetForce* of_block,
                      cudaStream_t stream);

/// The acceleration that particles hold := a - |a| share.
template <class Real>
void launch_hold(const double* acceleration, Vec3d share, const ParticleView<Real>& particles, unsigned count,
                 cudaStream_t stream);

}  // namespace breccia::cuda

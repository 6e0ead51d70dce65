// What a thread block keeps of its tile in shared memory.
#pragma once

#include "cuda/device_runtime.hpp"
#include "cuda/launchers.hpp"
#include "cuda/node_order.hpp"
#include "cuda/work_sums.cuh"

namespace breccia::cuda {

inline constexpr int kStencil = 3;
inline constexpr int kStencilNodes = 27;
inline constexpr unsigned kStencilLanes = (1U << kStencilNodes) - 1;

/// Velocities in shared memory: threads read nodes of their own. Planes are shifted by as many banks as the four cells
/// of a row take, so that the particles of neighbouring rows and planes do not meet.
inline constexpr int kReadPlane = grid::kTileWidth * grid::kTileWidth + 4;
BRECCIA_HD constexpr int read_node(int x, int y, int z) { return x * kReadPlane + y * grid::kTileWidth + z; }
inline constexpr int kReadNodes = read_node(grid::kTileWidth - 1, grid::kTileWidth - 1, grid::kTileWidth - 1) + 1;
/// Sums in shared memory: lanes add to the 27 nodes of one stencil, of which two share a bank.
inline constexpr int kSumPlane = grid::kTileWidth * grid::kTileWidth + kStencil;
BRECCIA_HD constexpr int sum_node(int x, int y, int z) { return x * kSumPlane + y * grid::kTileWidth + z; }
inline constexpr int kSumNodes = sum_node(grid::kTileWidth - 1, grid::kTileWidth - 1, grid::kTileWidth - 1) + 1;

/// A linear field about the nearest node: node (r) gets w (value + slope . r), r in cells.
template <class Real>
struct alignas(16) Linear {
  Real value, x, y, z;
};

/// What a particle gives to its 27 nodes. All members are read at once by all lanes, 16 bytes at a time.
template <class Real>
struct alignas(16) Spread {
  Linear<Real> momentum[3];
  Real force[3];
  Sym3<Real> slope;  ///< of the force
  Real offset[3];    ///< from the nearest node [cells]
};

/// Parts of the particles with sums of their own: the fewer warps share a particle, the less often its weights are
/// found, and the more shared memory is taken.
inline constexpr int kParts = 2;

template <class Real>
struct TileShared {
  union {
    Spread<Real> spread[kPassThreads];
    ThreadWork work[kPassThreads];  ///< once the last particle is done
  };
  Real mass[kPassThreads];
  int start[kPassThreads];  ///< first node of the stencil
  Real velocities[kVelocities][kReadNodes];
  Real sums[kParts][kSums][kSumNodes];
  unsigned touched;  ///< 8 bits an axis: first nodes of the stencils

  BRECCIA_HD TileShared() {}
};

}  // namespace breccia::cuda

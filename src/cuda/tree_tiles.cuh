// What a thread block that sums the field of a group keeps in shared memory: distant cells and near particles.
#pragma once

#include "cuda/gravity_pairs.cuh"
#include "gravity/tree/cell.hpp"

namespace breccia::cuda {

/// A cell as seen from an origin.
template <class Real>
struct DistantCell {
  Vec3<Real> position;
  gravity::Moments<Real> moments;

  __device__ __forceinline__ void set(const gravity::Cell& cell, Vec3d origin) {
    position = to_real<Real>(cell.centre - origin);
    const Sym3<double>& s = cell.moments.second;
    moments = {static_cast<Real>(cell.moments.mass),
               {static_cast<Real>(s.xx), static_cast<Real>(s.yy), static_cast<Real>(s.zz), static_cast<Real>(s.xy),
                static_cast<Real>(s.xz), static_cast<Real>(s.yz)}};
  }
};

inline constexpr unsigned kTileCells = 64;
template <class Real>
struct CellTile {
  DistantCell<Real> cell[kTileCells];
};
template <class Real>
struct GroupShared {
  PairTile<Real> pairs;
  CellTile<Real> cells;
};

}  // namespace breccia::cuda

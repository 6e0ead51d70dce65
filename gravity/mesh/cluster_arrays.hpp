// Particles in clusters of 16 neighbours, as the mesh and near-field kernels read them. No containers here: kernel
// files include this.
#pragma once

#include <cstdint>

namespace breccia::gravity {

inline constexpr std::int64_t kClusterSize = 16;

/// All lengths in mesh cells, from node 0 of the mesh. Centres are multiples of 2^-8, so that their differences are
/// exact; a position is centre + offset. Slots that no particle fills repeat one that is filled, with mass 0. The
/// arrays go on for kClusterSize clusters more than `count`.
template <class Real>
struct ClusterArrays {
  std::int64_t count;
  const Real* centre[3];  ///< of each cluster
  const Real* half[3];    ///< half extents about the centre, not less than any offset
  const Real* offset[3];  ///< of each slot: kClusterSize per cluster
  const Real* mass;       ///< of each slot
};

/// Columns along z over a regular grid in x and y; each holds the clusters [first[c], first[c+1]), c = ix * ny + iy.
struct ClusterColumns {
  double low[2];  ///< corner of column (0, 0) [cells]
  double width;   ///< [cells]
  int nx, ny;
  const std::int64_t* first;  ///< nx * ny + 1 numbers
};

}  // namespace breccia::gravity

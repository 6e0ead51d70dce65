// Where the nodes of a particle mesh lie.
#pragma once

#include "gravity/mesh/box.hpp"
#include "gravity/mesh/convolution.hpp"

namespace breccia::gravity {

/// Nodes around the edge that particles do not reach: 1 for the TSC cloud and 3 for 6-point differences, of which the
/// nearest node takes half a cell.
inline constexpr int kEdgeNodes = 4;

/// A mesh around `box`: its middle is the box's, its size the smallest whose transforms are fast. The mesh therefore
/// moves with the body it follows.
struct MeshGeometry {
  Vec3d origin{};        ///< of node (0, 0, 0) [m]
  double spacing = 1.0;  ///< [m]
  MeshSize size{};

  MeshGeometry() = default;
  MeshGeometry(const Box& box, double cell);

  /// Position in cells from the origin.
  [[nodiscard]] Vec3d in_cells(Vec3d p) const { return (1.0 / spacing) * (p - origin); }
};

}  // namespace breccia::gravity

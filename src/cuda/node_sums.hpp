// What the tiles of this rank have scattered to a node.
#pragma once

#include "cuda/node_order.hpp"
#include "cuda/step_arguments.hpp"

namespace breccia::cuda {

/// Sums of all tiles that reach a node: along each axis its own and the nearer neighbour.
template <class Real>
BRECCIA_HD void collect(const GridView<Real>& g, unsigned block, NodePosition n, Real (&sums)[kSums]) {
  const int position[3] = {n.x, n.y, n.z};
  for (int corner = 0; corner < 8; ++corner) {
    int direction[3];
    int local[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int side = position[axis] < grid::kTileMargin ? -1 : 1;
      direction[axis] = (corner >> axis & 1) != 0 ? side : 0;
      local[axis] = position[axis] + grid::kTileMargin - grid::kBlockWidth * direction[axis];
    }
    const unsigned tile =
        g.neighbours[block * 27 +
                     static_cast<unsigned>(((direction[0] + 1) * 3 + direction[1] + 1) * 3 + direction[2] + 1)];
    if (tile >= g.tiles) continue;
    const PackedBox box = g.boxes[tile];
    if (!box_holds(box, local[0], 0) || !box_holds(box, local[1], 1) || !box_holds(box, local[2], 2)) continue;
    const Real* from = g.partial_sums + std::size_t{tile} * kSums * kTileNodes +
                       node_place<grid::kTileWidth>(local[0], local[1], local[2]);
    for (int c = 0; c < kSums; ++c) sums[c] += from[c * kTileNodes];
  }
}

}  // namespace breccia::cuda

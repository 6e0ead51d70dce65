#include "gravity/mesh/geometry.hpp"

#include <algorithm>
#include <cmath>

#include "gravity/mesh/mesh_kernels.hpp"

namespace breccia::gravity {
namespace {

struct Axis {
  int nodes, padded;
  double origin;
};

Axis lay_axis(double low, double high, double cell) {
  const int cells = static_cast<int>(std::ceil((high - low) / cell));
  const int least = std::max(cells + 1 + 2 * kEdgeNodes, kLeastNodes);
  // Masses stay 3 nodes from the edge, the potential is wanted on all: the longest distance is nodes - 4.
  const int padded = fft_friendly_length(2 * least - 7);
  const int nodes = padded / 2 + 3;
  return {nodes, padded, 0.5 * (low + high) - 0.5 * (nodes - 1) * cell};
}

}  // namespace

MeshGeometry::MeshGeometry(const Box& box, double cell) : spacing(cell) {
  const Axis x = lay_axis(box.low.x, box.high.x, cell);
  const Axis y = lay_axis(box.low.y, box.high.y, cell);
  const Axis z = lay_axis(box.low.z, box.high.z, cell);
  origin = {x.origin, y.origin, z.origin};
  size = {{x.nodes, y.nodes, z.nodes}, {x.padded, y.padded, z.padded}};
}

}  // namespace breccia::gravity

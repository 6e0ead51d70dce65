// Sums to velocities: each node collects what the tiles around it have scattered, always in the same order.
#include "cuda/check.hpp"
#include "cuda/launchers.hpp"
#include "cuda/node_order.hpp"
#include "grid/wall.hpp"

namespace breccia::cuda {
namespace {

constexpr unsigned kThreads = 128;

// Sums of all tiles that reach a node: along each axis its own and the nearer neighbour.
template <class Real>
BRECCIA_HD void collect(const GridView<Real>& grid, unsigned block, NodePosition n, Real (&sums)[kSums]) {
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
        grid.neighbours[block * 27 +
                        static_cast<unsigned>(((direction[0] + 1) * 3 + direction[1] + 1) * 3 + direction[2] + 1)];
    if (tile >= grid.tiles) continue;
    const PackedBox box = grid.boxes[tile];
    if (!box_holds(box, local[0], 0) || !box_holds(box, local[1], 1) || !box_holds(box, local[2], 2)) continue;
    const Real* from = grid.partial_sums + std::size_t{tile} * kSums * kTileNodes +
                       node_place<grid::kTileWidth>(local[0], local[1], local[2]);
    for (int c = 0; c < kSums; ++c) sums[c] += from[c * kTileNodes];
  }
}

template <class Real>
BRECCIA_HD void apply_walls(const NodeArguments<Real>& a, unsigned block, NodePosition n, Real (&v)[kVelocities]) {
  const grid::BlockCoord b = grid::block_coord(a.grid.block_keys[block]);
  const Vec3d x = a.cell * Vec3d{static_cast<double>(grid::kBlockWidth * b.x + n.x),
                                 static_cast<double>(grid::kBlockWidth * b.y + n.y),
                                 static_cast<double>(grid::kBlockWidth * b.z + n.z)};
  for (int w = 0; w < a.wall_count; ++w) {
    if (!grid::holds_node(a.walls[w], x, a.cell)) continue;
    const Vec3d allowed = grid::constrained(a.walls[w], {v[0], v[1], v[2]});
    v[0] = static_cast<Real>(allowed.x);
    v[1] = static_cast<Real>(allowed.y);
    v[2] = static_cast<Real>(allowed.z);
  }
}

template <class Real>
__global__ void __launch_bounds__(kThreads) node_update(NodeArguments<Real> a) {
  const unsigned node = blockIdx.x * kThreads + threadIdx.x;
  const unsigned block = node / grid::kBlockNodes;
  if (block >= a.grid.blocks) return;
  const unsigned place = node % grid::kBlockNodes;
  const NodePosition n = node_position<grid::kBlockWidth>(static_cast<int>(place));
  Real sums[kSums] = {};
  collect(a.grid, block, n, sums);
  Real v[kVelocities] = {};
  if (sums[kMass] > a.smallest_mass) {
    const Real per_mass = Real(1) / sums[kMass];
    for (int axis = 0; axis < 3; ++axis) {
      v[kOldVelocity + axis] = sums[kMomentum + axis] * per_mass;
      v[kNewVelocity + axis] = v[kOldVelocity + axis] + a.kick * (sums[kForce + axis] * per_mass);
    }
  } else {
    sums[kMass] = Real(0);
  }
  if (a.wall_count > 0) apply_walls(a, block, n, v);
  Real* to = a.grid.velocities + std::size_t{block} * kSums * grid::kBlockNodes + place;
  for (int c = 0; c < kVelocities; ++c) to[c * grid::kBlockNodes] = v[c];
  to[kMass * grid::kBlockNodes] = sums[kMass];
}

}  // namespace

template <class Real>
void launch_node_update(const NodeArguments<Real>& a, cudaStream_t stream) {
  if (a.grid.blocks == 0) return;
  BRECCIA_LAUNCH(node_update<Real>, dim3(blocks_for(a.grid.blocks * grid::kBlockNodes, kThreads)), dim3(kThreads), 0,
                 stream, a);
  check(cudaGetLastError(), "launch of the node update");
}

template void launch_node_update<float>(const NodeArguments<float>&, cudaStream_t);
template void launch_node_update<double>(const NodeArguments<double>&, cudaStream_t);

}  // namespace breccia::cuda

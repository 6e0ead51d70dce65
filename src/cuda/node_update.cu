// Sums to velocities: each node collects what the tiles around it have scattered, always in the same order.
#include "cuda/check.hpp"
#include "cuda/launchers.hpp"
#include "cuda/node_order.hpp"
#include "cuda/node_sums.hpp"
#include "grid/wall.hpp"

namespace breccia::cuda {
namespace {

constexpr unsigned kThreads = 128;

// What other ranks hold of the node joins in the order of ranks: all of them find the same bits.
template <class Real>
BRECCIA_HD void add_shared(const SharedView<Real>& shared, unsigned list, unsigned place, Real (&sums)[kSums]) {
  Real total[kSums] = {};
  const auto add_own = [&] {
    for (int c = 0; c < kSums; ++c) total[c] += sums[c];
  };
  const unsigned first = shared.first[list];
  const unsigned last = shared.first[list + 1];
  for (unsigned n = first; n < last; ++n) {
    if (n == first + shared.lower[list]) add_own();
    const Real* from = shared.received + std::size_t{shared.places[n]} * kSums * grid::kBlockNodes + place;
    for (int c = 0; c < kSums; ++c) total[c] += from[c * grid::kBlockNodes];
  }
  if (shared.lower[list] == last - first) add_own();
  for (int c = 0; c < kSums; ++c) sums[c] = total[c];
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
  if (a.shared.list_of_block != nullptr) {
    const unsigned list = a.shared.list_of_block[block];
    if (list != grid::kNoBlock) add_shared(a.shared, list, place, sums);
  }
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

// Sums of this rank's tiles at the nodes of some blocks, to be sent.
template <class Real>
__global__ void __launch_bounds__(kThreads)
    collect_shared(GridView<Real> g, const unsigned* blocks, unsigned count, Real* to) {
  const unsigned node = blockIdx.x * kThreads + threadIdx.x;
  const unsigned n = node / grid::kBlockNodes;
  if (n >= count) return;
  const unsigned place = node % grid::kBlockNodes;
  Real sums[kSums] = {};
  collect(g, blocks[n], node_position<grid::kBlockWidth>(static_cast<int>(place)), sums);
  for (unsigned c = 0; c < kSums; ++c) to[(n * kSums + c) * grid::kBlockNodes + place] = sums[c];
}

}  // namespace

template <class Real>
void prepare_node_update() {
  load(&collect_shared<Real>);
  load(&node_update<Real>);
}

template <class Real>
void launch_collect_shared(const GridView<Real>& view, const unsigned* blocks, unsigned count, Real* to,
                           cudaStream_t stream) {
  if (count == 0) return;
  BRECCIA_LAUNCH(collect_shared<Real>, dim3(blocks_for(count * grid::kBlockNodes, kThreads)), dim3(kThreads), 0, stream,
                 view, blocks, count, to);
  check(cudaGetLastError(), "launch of the halo");
}

template <class Real>
void launch_node_update(const NodeArguments<Real>& a, cudaStream_t stream) {
  if (a.grid.blocks == 0) return;
  BRECCIA_LAUNCH(node_update<Real>, dim3(blocks_for(a.grid.blocks * grid::kBlockNodes, kThreads)), dim3(kThreads), 0,
                 stream, a);
  check(cudaGetLastError(), "launch of the node update");
}

template void prepare_node_update<float>();
template void prepare_node_update<double>();
template void launch_collect_shared<float>(const GridView<float>&, const unsigned*, unsigned, float*, cudaStream_t);
template void launch_collect_shared<double>(const GridView<double>&, const unsigned*, unsigned, double*, cudaStream_t);
template void launch_node_update<float>(const NodeArguments<float>&, cudaStream_t);
template void launch_node_update<double>(const NodeArguments<double>&, cudaStream_t);

}  // namespace breccia::cuda

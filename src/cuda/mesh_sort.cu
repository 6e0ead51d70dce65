// Bodies dealt out to boxes, and in each sorted to nodes and cut into clusters.
#include <cmath>

#include "cuda/check.hpp"
#include "cuda/launchers.hpp"
#include "cuda/mesh_kernels.hpp"
#include "cuda/search.cuh"

namespace breccia::cuda {
namespace {

constexpr unsigned kThreads = 128;
constexpr unsigned kWarp = kClusterBodies;
constexpr unsigned kAllLanes = 0xffffffffU;

__device__ __forceinline__ unsigned thread_number() { return blockIdx.x * kThreads + threadIdx.x; }

__global__ void __launch_bounds__(kThreads)
    set_keys(BodyArrays bodies, BoxList boxes, std::uint64_t* keys, unsigned* order) {
  const unsigned i = thread_number();
  if (i >= bodies.count) return;
  keys[i] = gravity::set_of(bodies.at(i), boxes.box, boxes.count);
  order[i] = i;
}

__global__ void __launch_bounds__(kThreads) gather_bodies(BodyArrays bodies, const unsigned* order, double* to) {
  const unsigned i = thread_number();
  if (i >= bodies.count) return;
  const std::size_t n = bodies.count;
  const unsigned from = order[i];
  for (unsigned axis = 0; axis < 3; ++axis) to[axis * n + i] = bodies.position[axis][from];
  to[3 * n + i] = bodies.mass[from];
}

__device__ __forceinline__ Vec3d in_cells(const MeshNodes& nodes, Vec3d x) {
  return nodes.per_cell * (x - nodes.origin);
}

__global__ void __launch_bounds__(kThreads)
    mesh_keys(BodyArrays bodies, MeshNodes nodes, std::uint64_t* keys, unsigned* order) {
  const unsigned i = thread_number();
  if (i >= bodies.count) return;
  const Vec3d x = in_cells(nodes, bodies.at(i));
  keys[i] = nodes.key(static_cast<int>(x.x + 0.5), static_cast<int>(x.y + 0.5), static_cast<int>(x.z + 0.5));
  order[i] = i;
}

__global__ void __launch_bounds__(kThreads)
    arrange_in_mesh(BodyArrays bodies, MeshNodes nodes, double mass_unit, unsigned first, unsigned own,
                    const unsigned* order, MeshBodies to) {
  const unsigned i = thread_number();
  if (i >= bodies.count) return;
  const unsigned from = order[i];
  const Vec3d x = in_cells(nodes, bodies.at(from));
  to.position[0][i] = x.x;
  to.position[1][i] = x.y;
  to.position[2][i] = x.z;
  to.mass[i] = bodies.mass[from] / mass_unit;
  const unsigned target = bodies.place(from) - first;
  to.target[i] = target < own ? target : kNoTarget;
}

__device__ __forceinline__ unsigned column_begin(const MeshNodes& nodes, const MeshBodies& bodies, unsigned column) {
  return bodies.first[column * nodes.of_column()];
}

__global__ void __launch_bounds__(kThreads) count_clusters(MeshNodes nodes, MeshBodies bodies, unsigned* count) {
  const unsigned c = thread_number();
  if (c > nodes.column_count()) return;
  const unsigned in_column =
      c < nodes.column_count() ? column_begin(nodes, bodies, c + 1) - column_begin(nodes, bodies, c) : 0U;
  count[c] = (in_column + kClusterBodies - 1) / kClusterBodies;
}

// A warp for each cluster. Bounds are widened by what their rounding may be.
template <class Real>
__global__ void __launch_bounds__(kThreads)
    bound_clusters(MeshNodes nodes, MeshBodies bodies, Clusters<Real> clusters) {
  const unsigned c = thread_number() / kWarp;
  const unsigned columns = nodes.column_count();
  if (c >= clusters.first[columns]) return;
  const unsigned column = place_of(c, clusters.first, columns);
  const unsigned begin = column_begin(nodes, bodies, column) + kClusterBodies * (c - clusters.first[column]);
  const unsigned last = column_begin(nodes, bodies, column + 1);
  const unsigned end = begin + kClusterBodies < last ? begin + kClusterBodies : last;
  const unsigned lane = threadIdx.x % kWarp;
  const Vec3d x = bodies.at(begin + lane < end ? begin + lane : begin);
  Vec3d low = x;
  Vec3d high = x;
  for (unsigned step = kWarp / 2; step > 0; step /= 2) {
    low = {std::fmin(low.x, __shfl_down_sync(kAllLanes, low.x, step)),
           std::fmin(low.y, __shfl_down_sync(kAllLanes, low.y, step)),
           std::fmin(low.z, __shfl_down_sync(kAllLanes, low.z, step))};
    high = {std::fmax(high.x, __shfl_down_sync(kAllLanes, high.x, step)),
            std::fmax(high.y, __shfl_down_sync(kAllLanes, high.y, step)),
            std::fmax(high.z, __shfl_down_sync(kAllLanes, high.z, step))};
  }
  if (lane != 0) return;
  constexpr double kSlack = 1e-3;
  const Vec3d centre = 0.5 * (low + high);
  const Vec3d half = 0.5 * (high - low);
  clusters.cluster[c] = {
      {static_cast<Real>(centre.x), static_cast<Real>(centre.y), static_cast<Real>(centre.z)},
      {static_cast<Real>(half.x + kSlack), static_cast<Real>(half.y + kSlack), static_cast<Real>(half.z + kSlack)},
      begin,
      end};
}

dim3 threads_for(unsigned items) { return {blocks_for(items, kThreads)}; }
void launched() { check(cudaGetLastError(), "launch of a kernel that sorts bodies to a mesh"); }

}  // namespace

void launch_set_keys(const BodyArrays& bodies, const BoxList& boxes, std::uint64_t* keys, unsigned* order,
                     cudaStream_t stream) {
  if (bodies.count == 0) return;
  BRECCIA_LAUNCH(set_keys, threads_for(bodies.count), dim3(kThreads), 0, stream, bodies, boxes, keys, order);
  launched();
}

void launch_gather_bodies(const BodyArrays& bodies, const unsigned* order, double* to, cudaStream_t stream) {
  if (bodies.count == 0) return;
  BRECCIA_LAUNCH(gather_bodies, threads_for(bodies.count), dim3(kThreads), 0, stream, bodies, order, to);
  launched();
}

void launch_mesh_keys(const BodyArrays& bodies, const MeshNodes& nodes, std::uint64_t* keys, unsigned* order,
                      cudaStream_t stream) {
  BRECCIA_LAUNCH(mesh_keys, threads_for(bodies.count), dim3(kThreads), 0, stream, bodies, nodes, keys, order);
  launched();
}

void launch_arrange_in_mesh(const BodyArrays& bodies, const MeshNodes& nodes, double mass_unit, unsigned first,
                            unsigned own, const unsigned* order, const MeshBodies& to, cudaStream_t stream) {
  BRECCIA_LAUNCH(arrange_in_mesh, threads_for(bodies.count), dim3(kThreads), 0, stream, bodies, nodes, mass_unit, first,
                 own, order, to);
  launched();
}

template <class Real>
void launch_count_clusters(const MeshNodes& nodes, const MeshBodies& bodies, const Clusters<Real>& clusters,
                           cudaStream_t stream) {
  BRECCIA_LAUNCH(count_clusters, threads_for(nodes.column_count() + 1), dim3(kThreads), 0, stream, nodes, bodies,
                 clusters.first);
  launched();
}

template <class Real>
void launch_bound_clusters(const MeshNodes& nodes, const MeshBodies& bodies, const Clusters<Real>& clusters,
                           cudaStream_t stream) {
  BRECCIA_LAUNCH(bound_clusters<Real>, dim3(blocks_for(clusters.most, kThreads / kWarp)), dim3(kThreads), 0, stream,
                 nodes, bodies, clusters);
  launched();
}

template void launch_count_clusters<float>(const MeshNodes&, const MeshBodies&, const Clusters<float>&, cudaStream_t);
template void launch_count_clusters<double>(const MeshNodes&, const MeshBodies&, const Clusters<double>&, cudaStream_t);
template void launch_bound_clusters<float>(const MeshNodes&, const MeshBodies&, const Clusters<float>&, cudaStream_t);
template void launch_bound_clusters<double>(const MeshNodes&, const MeshBodies&, const Clusters<double>&, cudaStream_t);

}  // namespace breccia::cuda

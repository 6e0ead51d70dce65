// Pairs of a box that are closer than the cutoff, by the short-range law of gravity/mesh/split.hpp. A warp is a cluster
// of targets, a lane one of them: it finds the clusters within reach in the columns around it, packs those of their
// bodies that may be near into a list in shared memory, and works that off when it is full.
#include <cmath>

#include "cuda/check.hpp"
#include "cuda/gravity_pairs.cuh"
#include "cuda/launchers.hpp"
#include "cuda/near_list.cuh"

namespace breccia::cuda {
namespace {

constexpr unsigned kThreads = kNearThreads;
constexpr unsigned kWarp = kClusterBodies;
constexpr unsigned kAllLanes = 0xffffffffU;

template <class Real>
__device__ __forceinline__ Real beyond(Real distance, Real half) {
  const Real d = (distance < Real(0) ? -distance : distance) - half;
  return d > Real(0) ? d : Real(0);
}

template <class Real>
__device__ __forceinline__ bool clusters_near(const Cluster<Real>& a, const Cluster<Real>& b, Real reach_squared) {
  Real distance_squared(0);
  for (int axis = 0; axis < 3; ++axis) {
    const Real gap = beyond(a.centre[axis] - b.centre[axis], a.half[axis] + b.half[axis]);
    distance_squared += gap * gap;
  }
  return distance_squared < reach_squared;
}

template <class Real>
__device__ __forceinline__ Vec3<Real> seen_from(Vec3d x, const Cluster<Real>& cluster) {
  return {static_cast<Real>(x.x - static_cast<double>(cluster.centre[0])),
          static_cast<Real>(x.y - static_cast<double>(cluster.centre[1])),
          static_cast<Real>(x.z - static_cast<double>(cluster.centre[2]))};
}

// Columns within reach of the cluster along x or y, [begin, end).
struct ColumnRange {
  int begin, end;
};
template <class Real>
__device__ __forceinline__ ColumnRange columns_near(const MeshNodes& nodes, const Cluster<Real>& cluster, int axis,
                                                    Real reach) {
  const auto low = static_cast<int>(std::floor(cluster.centre[axis] - cluster.half[axis] - reach + Real(0.5)));
  const auto high = static_cast<int>(std::floor(cluster.centre[axis] + cluster.half[axis] + reach + Real(0.5)));
  const int first = (low > 0 ? low : 0) / nodes.column;
  const int last = high / nodes.column;
  return {first, last + 1 < nodes.columns[axis] ? last + 1 : nodes.columns[axis]};
}

// What a lane keeps.
template <class Real>
struct Target {
  Vec3<Real> position;
  Vec3d sum{};
};

template <class Real, int kDegree>
__device__ __forceinline__ void work_off(const NearSource<Real>* list, unsigned count,
                                         const gravity::ShortRange<Real>& law, Target<Real>& target) {
  const gravity::ShortRangePair<kDegree, Real, Real> pair(law);
  __syncwarp();
  Vec3<Real> sum{};
  for (unsigned j = 0; j < count; ++j) {
    const NearSource<Real> s = list[j];
    const Vec3<Real> d = s.position - target.position;
    const Real rho2 = dot(d, d) + law.softening_squared;
    const Real q = rho2 <= gravity::kCoincidentSquared<Real> ? Real(0) : inverse_root(rho2);
    const Real mass = rho2 < law.cutoff_squared ? s.mass : Real(0);
    sum += (mass * pair.force(rho2, q)) * d;
  }
  target.sum += {static_cast<double>(sum.x), static_cast<double>(sum.y), static_cast<double>(sum.z)};
  __syncwarp();
}

// Blocks on a multiprocessor: with fewer registers those of doubles would spill.
template <class Real>
inline constexpr int kBlocks = sizeof(Real) == 4 ? 8 : 5;

template <class Real, int kDegree>
__global__ void __launch_bounds__(kThreads, kBlocks<Real>) sum_near(NearArguments<Real> a) {
  BRECCIA_SHARED(NearShared<Real>, shared);
  const unsigned c = (blockIdx.x * kThreads + threadIdx.x) / kWarp;
  const unsigned lane = threadIdx.x % kWarp;
  if (c >= a.clusters.first[a.nodes.column_count()]) return;
  const Cluster<Real> own = a.clusters.cluster[c];
  const unsigned i = own.begin + lane < own.end ? own.begin + lane : own.begin;
  const unsigned to = own.begin + lane < own.end ? a.bodies.target[i] : kNoTarget;
  if (__ballot_sync(kAllLanes, to != kNoTarget ? 1 : 0) == 0) return;

  Target<Real> target{seen_from(a.bodies.at(i), own), {}};
  NearSource<Real>* list = shared.list[threadIdx.x / kWarp];
  unsigned listed = 0;
  unsigned long long pairs = 0;
  const Real reach = std::sqrt(a.law.cutoff_squared);
  const ColumnRange x = columns_near(a.nodes, own, 0, reach);
  const ColumnRange y = columns_near(a.nodes, own, 1, reach);
  for (int column_x = x.begin; column_x < x.end; ++column_x) {
    // Columns that follow each other along y are one stretch of clusters.
    const unsigned* first = a.clusters.first + column_x * a.nodes.columns[1];
    const unsigned last = first[y.end];
    for (unsigned at = first[y.begin]; at < last; at += kWarp) {
      const bool near = at + lane < last && clusters_near(a.clusters.cluster[at + lane], own, a.law.cutoff_squared);
      for (unsigned rest = __ballot_sync(kAllLanes, near ? 1 : 0); rest != 0; rest &= rest - 1) {
        const Cluster<Real>& source = a.clusters.cluster[at + static_cast<unsigned>(__ffs(static_cast<int>(rest)) - 1)];
        const unsigned j = source.begin + lane;
        NearSource<Real> s{};
        bool take = j < source.end;
        if (take) {
          s = {seen_from(a.bodies.at(j), own), static_cast<Real>(a.bodies.mass[j])};
          const Vec3<Real> gap{beyond(s.position.x, own.half[0]), beyond(s.position.y, own.half[1]),
                               beyond(s.position.z, own.half[2])};
          take = dot(gap, gap) < a.law.cutoff_squared;
        }
        const unsigned taken = __ballot_sync(kAllLanes, take ? 1 : 0);
        if (take) list[listed + static_cast<unsigned>(__popc(taken & ((1U << lane) - 1)))] = s;
        listed += static_cast<unsigned>(__popc(taken));
        if (listed < kListed) continue;
        work_off<Real, kDegree>(list, listed, a.law, target);
        pairs += listed;
        listed = 0;
      }
    }
  }
  work_off<Real, kDegree>(list, listed, a.law, target);
  pairs += listed;
  if (lane == 0) atomicAdd(a.pairs, pairs * (own.end - own.begin));
  if (to == kNoTarget) return;
  a.acceleration[to] += a.unit * target.sum.x;
  a.acceleration[a.own + to] += a.unit * target.sum.y;
  a.acceleration[2 * std::size_t{a.own} + to] += a.unit * target.sum.z;
}

template <class Real, int kDegree>
void launch_degree(const NearArguments<Real>& a, cudaStream_t stream) {
  BRECCIA_LAUNCH((sum_near<Real, kDegree>), dim3(blocks_for(a.clusters.most, kThreads / kWarp)), dim3(kThreads),
                 sizeof(NearShared<Real>), stream, a);
  check(cudaGetLastError(), "launch of the sum over near pairs");
}

}  // namespace

template <class Real>
void launch_sum_near(const NearArguments<Real>& a, cudaStream_t stream) {
  switch (a.law.degree) {
    case 8:
      return launch_degree<Real, 8>(a, stream);
    case 10:
      return launch_degree<Real, 10>(a, stream);
    default:
      return launch_degree<Real, 12>(a, stream);
  }
}
template void launch_sum_near<float>(const NearArguments<float>&, cudaStream_t);
template void launch_sum_near<double>(const NearArguments<double>&, cudaStream_t);

}  // namespace breccia::cuda

#include "breccia/constants.hpp"
#include "cuda/direct_gravity.hpp"
#include "cuda/gravity_pairs.cuh"
#include "cuda/launchers.hpp"

namespace breccia::cuda {
namespace {

__device__ __forceinline__ Vec3d position_of(const BodyArrays& bodies, unsigned i) {
  return {bodies.position[0][i], bodies.position[1][i], bodies.position[2][i]};
}

// A tile is wide beyond so many softening lengths: there the rounding of floats would show in the distances of
// neighbours.
constexpr double kNarrow = 1024.0;

/// What rounding leaves of a position.
template <class Real>
__device__ __forceinline__ Vec3<Real> rest_of(Vec3d x) {
  return to_real<Real>(x - to_double(to_real<Real>(x)));
}

/// sum_of_tile() on exact differences of coordinates. Rare: sources among debris.
template <class Real>
__device__ __forceinline__ Vec3d sum_of_wide_tile(const DirectTile<Real>& tile, unsigned count, Vec3d target,
                                                  Real softening_squared) {
  const Vec3<Real> position = to_real<Real>(target);
  const Vec3<Real> rest = rest_of<Real>(target);
  Vec3<Real> sum{};
  for (unsigned j = 0; j < count; ++j) {
    const PointMass<Real> s = tile.pairs.source[j];
    const Vec3<Real> d = (s.position - position) + (tile.rest[j] - rest);
    sum += (s.mass * gravity::newton_pair(inverse_root(dot(d, d) + softening_squared)).force) * d;
  }
  return to_double(sum);
}

// sums[slice][3][targets] of the sources [slice * tiles, (slice + 1) * tiles) tiles.
template <class Real>
__global__ void __launch_bounds__(kTileSources) direct_sum(DirectArguments a, unsigned tiles, double* sums) {
  BRECCIA_SHARED(DirectTile<Real>, tile);
  const BodyArrays& sources = a.sources;
  const unsigned i = blockIdx.x * kTileSources + threadIdx.x;
  const Vec3d target = position_of(sources, a.first + (i < a.targets ? i : 0));
  const auto softening = squared_softening<Real>(a.softening);
  const double narrow = kNarrow * kNarrow * a.softening * a.softening;
  const double per_unit = 1.0 / a.mass_unit;
  Vec3d sum{};
  const unsigned begin = blockIdx.y * tiles * kTileSources;
  for (unsigned t = 0; t < tiles; ++t) {
    const unsigned from = begin + t * kTileSources;
    if (from >= sources.count) break;
    const unsigned count = sources.count - from < kTileSources ? sources.count - from : kTileSources;
    // Particles come in the order of space, so most tiles are small.
    const Vec3d origin = position_of(sources, from + count / 2);
    bool far = false;
    if (threadIdx.x < count) {
      const unsigned j = from + threadIdx.x;
      const Vec3d x = position_of(sources, j) - origin;
      const Vec3<Real> position = to_real<Real>(x);
      far = sizeof(Real) == 4 && dot(x, x) > narrow;
      tile.pairs.source[threadIdx.x] = {position, static_cast<Real>(per_unit * sources.mass[j])};
      tile.rest[threadIdx.x] = rest_of<Real>(x);
    }
    const bool wide = __syncthreads_count(far ? 1 : 0) > 0;
    sum += wide ? sum_of_wide_tile(tile, count, target - origin, softening)
                : sum_of_tile(tile.pairs, count, to_real<Real>(target - origin), softening);
    __syncthreads();
  }
  if (i >= a.targets) return;
  double* own = sums + 3 * std::size_t{blockIdx.y} * a.targets + i;
  own[0] = sum.x;
  own[a.targets] = sum.y;
  own[2 * std::size_t{a.targets}] = sum.z;
}

// Adds the slices in their order.
__global__ void __launch_bounds__(kTileSources)
    add_slices(const double* sums, unsigned values, unsigned slices, double unit, double* acceleration) {
  const unsigned i = blockIdx.x * kTileSources + threadIdx.x;
  if (i >= values) return;
  double sum = 0.0;
  for (unsigned slice = 0; slice < slices; ++slice) sum += sums[std::size_t{slice} * values + i];
  acceleration[i] = unit * sum;
}

}  // namespace

template <class Real>
void launch_direct_sum(const DirectArguments& a, double* acceleration, DeviceArray<double>& scratch,
                       cudaStream_t stream) {
  if (a.targets == 0) return;
  const unsigned blocks = blocks_for(a.targets, kTileSources);
  const auto [tiles, slices] = direct_slices(a.targets, a.sources.count);
  const unsigned values = 3 * a.targets;
  scratch.reserve(std::size_t{slices} * values);
  BRECCIA_LAUNCH(direct_sum<Real>, dim3(blocks, slices), dim3(kTileSources), sizeof(DirectTile<Real>), stream, a, tiles,
                 scratch.data());
  BRECCIA_LAUNCH(add_slices, dim3(blocks_for(values, kTileSources)), dim3(kTileSources), 0, stream, scratch.data(),
                 values, slices, kGravitationalConstant * a.mass_unit, acceleration);
  check(cudaGetLastError(), "launch of a direct sum");
}
template void launch_direct_sum<float>(const DirectArguments&, double*, DeviceArray<double>&, cudaStream_t);
template void launch_direct_sum<double>(const DirectArguments&, double*, DeviceArray<double>&, cudaStream_t);

}  // namespace breccia::cuda

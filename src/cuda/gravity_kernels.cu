#include <cmath>

#include "cuda/check.hpp"
#include "cuda/gravity_kernels.hpp"
#include "cuda/launchers.hpp"

namespace breccia::cuda {
namespace {

constexpr unsigned kThreads = kReducerThreads;

// 2^-32 cells, or a double in cells.
__device__ __forceinline__ double cells_of(std::int32_t offset) { return 0x1p-32 * static_cast<double>(offset); }
__device__ __forceinline__ double cells_of(double offset) { return offset; }

__device__ __forceinline__ double component(Vec3d v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

template <class Real>
__global__ void __launch_bounds__(kThreads) predict(PredictArguments<Real> a, double* to) {
  const unsigned slot = blockIdx.x * kThreads + threadIdx.x;
  if (slot >= a.count) return;
  const ParticleView<Real>& p = a.particles;
  const grid::BlockCoord block = grid::block_coord(a.block_keys[slot]);
  for (unsigned axis = 0; axis < 3; ++axis) {
    const int i = static_cast<int>(axis);
    const int node = grid::kBlockWidth * grid::component(block, i) + (p.node[slot] >> (8 * i) & 255) - grid::kNodeBias;
    double x = a.cell * (node + cells_of(p.offset[p.at(axis, slot)]));
    const double start = component(a.period.start, i);
    const double length = component(a.period.length, i);
    if (length > 0) x -= length * std::floor((x - start) / length);
    to[axis * a.count + slot] = x + a.time * static_cast<double>(p.velocity[p.at(axis, slot)]);
  }
  to[3 * a.count + slot] = static_cast<double>(p.mass[slot]);
}

// Value k of all threads of a block becomes combine() of them, in the order of the threads.
template <int kValues>
struct ReduceShared {
  double of_thread[kThreads][kValues];
};
template <int kValues, class Combine>
__device__ __forceinline__ void reduce(ReduceShared<kValues>& shared, const double (&own)[kValues], double* result,
                                       const Combine& combine) {
  for (int k = 0; k < kValues; ++k) shared.of_thread[threadIdx.x][k] = own[k];
  __syncthreads();
  if (threadIdx.x >= kValues) return;
  double value = shared.of_thread[0][threadIdx.x];
  for (unsigned n = 1; n < kThreads; ++n) value = combine(value, shared.of_thread[n][threadIdx.x]);
  result[threadIdx.x] = value;
}

struct Larger {
  __device__ __forceinline__ double operator()(double a, double b) const { return b > a ? b : a; }
};
struct Plus {
  __device__ __forceinline__ double operator()(double a, double b) const { return a + b; }
};

__global__ void __launch_bounds__(kThreads) extremes(BodyArrays bodies, Extremes* of_block) {
  BRECCIA_SHARED(ReduceShared<7>, shared);
  const Larger larger;
  double own[7];
  for (double& value : own) value = -HUGE_VAL;
  for (unsigned i = blockIdx.x * kThreads + threadIdx.x; i < bodies.count; i += gridDim.x * kThreads) {
    for (int axis = 0; axis < 3; ++axis) {
      const double x = bodies.position[axis][i];
      own[axis] = larger(own[axis], x);
      own[3 + axis] = larger(own[3 + axis], -x);
    }
    own[6] = larger(own[6], bodies.mass[i]);
  }
  reduce(shared, own, of_block[blockIdx.x].of, larger);
}

template <class Real>
__global__ void __launch_bounds__(kThreads)
    net_force(const double* acceleration, const Real* mass, unsigned count, NetForce* of_block) {
  BRECCIA_SHARED(ReduceShared<4>, shared);
  double own[4] = {0, 0, 0, 0};
  for (unsigned i = blockIdx.x * kThreads + threadIdx.x; i < count; i += gridDim.x * kThreads) {
    const auto m = static_cast<double>(mass[i]);
    const Vec3d f{m * acceleration[i], m * acceleration[count + i], m * acceleration[2 * count + i]};
    own[0] += f.x;
    own[1] += f.y;
    own[2] += f.z;
    own[3] += std::sqrt(dot(f, f));
  }
  reduce(shared, own, of_block[blockIdx.x].of, Plus{});
}

template <class Real>
__global__ void __launch_bounds__(kThreads)
    hold(const double* acceleration, Vec3d share, ParticleView<Real> particles, unsigned count) {
  const unsigned i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= count) return;
  const Vec3d a{acceleration[i], acceleration[count + i], acceleration[2 * count + i]};
  const double size = std::sqrt(dot(a, a));
  particles.gravity[particles.at(0, i)] = static_cast<Real>(a.x - size * share.x);
  particles.gravity[particles.at(1, i)] = static_cast<Real>(a.y - size * share.y);
  particles.gravity[particles.at(2, i)] = static_cast<Real>(a.z - size * share.z);
}

void launched() { check(cudaGetLastError(), "launch of a kernel of gravity"); }

}  // namespace

template <class Real>
void launch_predict(const PredictArguments<Real>& a, double* to, cudaStream_t stream) {
  if (a.count == 0) return;
  BRECCIA_LAUNCH(predict<Real>, dim3(blocks_for(a.count, kThreads)), dim3(kThreads), 0, stream, a, to);
  launched();
}

void launch_extremes(const BodyArrays& bodies, Extremes* of_block, cudaStream_t stream) {
  BRECCIA_LAUNCH(extremes, dim3(reducers(bodies.count)), dim3(kThreads), sizeof(ReduceShared<7>), stream, bodies,
                 of_block);
  launched();
}

template <class Real>
void launch_net_force(const double* acceleration, const Real* mass, unsigned count, NetForce* of_block,
                      cudaStream_t stream) {
  BRECCIA_LAUNCH(net_force<Real>, dim3(reducers(count)), dim3(kThreads), sizeof(ReduceShared<4>), stream, acceleration,
                 mass, count, of_block);
  launched();
}

template <class Real>
void launch_hold(const double* acceleration, Vec3d share, const ParticleView<Real>& particles, unsigned count,
                 cudaStream_t stream) {
  if (count == 0) return;
  BRECCIA_LAUNCH(hold<Real>, dim3(blocks_for(count, kThreads)), dim3(kThreads), 0, stream, acceleration, share,
                 particles, count);
  launched();
}

#define BRECCIA_INSTANTIATE(Real)                                                                \
  template void launch_predict(const PredictArguments<Real>&, double*, cudaStream_t);            \
  template void launch_net_force(const double*, const Real*, unsigned, NetForce*, cudaStream_t); \
  template void launch_hold(const double*, Vec3d, const ParticleView<Real>&, unsigned, cudaStream_t);
BRECCIA_INSTANTIATE(float)
BRECCIA_INSTANTIATE(double)
#undef BRECCIA_INSTANTIATE

}  // namespace breccia::cuda

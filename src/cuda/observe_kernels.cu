#include "cuda/check.hpp"
#include "cuda/launchers.hpp"
#include "cuda/node_order.hpp"
#include "cuda/observe_kernels.hpp"
#include "cuda/particle_update.hpp"

namespace breccia::cuda {
namespace {

constexpr unsigned kThreads = 128;

template <class Real>
BRECCIA_HD void weights(Real d, Real (&w)[3]) {
  const Real lower = Real(0.5) - d;
  const Real upper = Real(0.5) + d;
  w[0] = Real(0.5) * lower * lower;
  w[1] = Real(0.75) - d * d;
  w[2] = Real(0.5) * upper * upper;
}

// --- velocities and masses of the nodes at the particles ----------------------------------------------------------

// Straight from the blocks: output steps are rare.
template <class Real>
__global__ void __launch_bounds__(kThreads) probe_tiles(ProbeArguments<Real> a) {
  const GridView<Real>& g = a.pass.grid;
  const ParticleView<Real>& p = a.pass.particles;
  const unsigned tile = blockIdx.x;
  for (unsigned slot = g.first[tile] + threadIdx.x; slot < g.first[tile + 1]; slot += kThreads) {
    Real w[3][3];
    Real offset[3];
    int start[3];
    for (int axis = 0; axis < 3; ++axis) {
      offset[axis] = offset_in_cells(p.offset[p.at(static_cast<unsigned>(axis), slot)]);
      weights(offset[axis], w[axis]);
      start[axis] = stencil_start(p.node[slot], axis);
    }
    Real sums[kSums] = {};
    Real gradient[9] = {};
    for (int n = 0; n < 27; ++n) {
      const int at[3] = {start[0] + n / 9, start[1] + n / 3 % 3, start[2] + n % 3};
      const unsigned block =
          g.neighbours[tile * 27 +
                       static_cast<unsigned>((block_of_tile_node(at[0]) * 3 + block_of_tile_node(at[1])) * 3 +
                                             block_of_tile_node(at[2]))];
      const int place =
          node_place<grid::kBlockWidth>(node_of_tile_node(at[0]), node_of_tile_node(at[1]), node_of_tile_node(at[2]));
      const Real weight = w[0][n / 9] * w[1][n / 3 % 3] * w[2][n % 3];
      const Real* from = g.velocities + std::size_t{block} * kSums * grid::kBlockNodes + place;
      for (int c = 0; c < kSums; ++c) sums[c] += weight * from[c * grid::kBlockNodes];
      const int step[3] = {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
      for (unsigned row = 0; row < 3; ++row) {
        const Real velocity = weight * from[(kNewVelocity + static_cast<int>(row)) * grid::kBlockNodes];
        for (unsigned axis = 0; axis < 3; ++axis) {
          gradient[3 * row + axis] += velocity * (static_cast<Real>(step[axis]) - offset[axis]);
        }
      }
    }
    for (unsigned axis = 0; axis < 3; ++axis) {
      a.new_velocity[axis * a.count + slot] =
          sums[kNewVelocity + axis] +
          a.pass.transfer.alpha * (p.velocity[p.at(axis, slot)] - sums[kOldVelocity + axis]);
    }
    a.node_mass[slot] = sums[kMass];
    for (unsigned n = 0; n < 9; ++n) a.gradient[n * a.count + slot] = Real(4) / a.pass.cell * gradient[n];
  }
}

// v + dt g, the particle's own mass on its nodes, sum w^2 m, and C with the kick of its own stress.
template <class Real>
__global__ void __launch_bounds__(kThreads) probe_lone(ProbeArguments<Real> a) {
  const unsigned n = blockIdx.x * kThreads + threadIdx.x;
  if (n >= a.pass.lone) return;
  const unsigned slot = a.pass.first_lone + n;
  const ParticleView<Real>& p = a.pass.particles;
  const Vec3<Real> g = gravity_of(a.pass, slot);
  const Real gravity[3] = {g.x, g.y, g.z};
  Real mass = p.mass[slot];
  for (unsigned axis = 0; axis < 3; ++axis) {
    Real w[3];
    weights(offset_in_cells(p.offset[p.at(axis, slot)]), w);
    mass *= w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    a.new_velocity[axis * a.count + slot] = p.velocity[p.at(axis, slot)] + a.pass.kick * gravity[axis];
  }
  a.node_mass[slot] = mass;
  constexpr unsigned rate_of[9] = {0, 3, 4, 3, 1, 5, 4, 5, 2};  // among xx, yy, zz, xy, xz, yz
  for (unsigned c = 0; c < 9; ++c) {
    a.gradient[c * a.count + slot] =
        p.velocity_gradient[p.at(c, slot)] - a.pass.kick * a.pass.lone_pull[rate_of[c] * a.pass.lone + n];
  }
}

// --- sums and largest values --------------------------------------------------------------------------------------

struct TotalShared {
  PassSums of_thread[kThreads];
};

__global__ void total_of(const PassSums* sums, unsigned count, PassSums* total) {
  BRECCIA_SHARED(TotalShared, shared);
  PassSums own{0, 0, 0};
  const auto add = [&own](const PassSums& other) {
    own.plastic_work += other.plastic_work;
    own.viscous_work += other.viscous_work;
    own.largest_move = max(own.largest_move, other.largest_move);
  };
  for (unsigned n = threadIdx.x; n < count; n += kThreads) add(sums[n]);
  shared.of_thread[threadIdx.x] = own;
  __syncthreads();
  if (threadIdx.x != 0) return;
  own = {0, 0, 0};
  for (unsigned n = 0; n < kThreads; ++n) add(shared.of_thread[n]);
  *total = own;
}

__device__ __forceinline__ unsigned long long ordered_bits(double x) {
  unsigned long long bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}

struct SignalShared {
  FastestSignals fastest;
};

template <class Real>
__global__ void __launch_bounds__(kThreads) signals(PassArguments<Real> a, const material::Constants<double>* materials,
                                                    unsigned count, FastestSignals* fastest) {
  BRECCIA_SHARED(SignalShared, shared);
  if (threadIdx.x == 0) shared.fastest = {};
  __syncthreads();
  const unsigned slot = blockIdx.x * kThreads + threadIdx.x;
  if (slot < count) {
    const ParticleView<Real>& p = a.particles;
    material::State<double> state{};
    state.volume.set(static_cast<double>(p.volume_change[slot]));
    if (a.effects.energy) state.energy.set(static_cast<double>(p.internal_energy[slot]));
    const material::Constants<double>& c = materials[p.body_material[slot] >> 16];
    atomicMax(&shared.fastest.sound, ordered_bits(material::longitudinal_sound_speed(a.effects, c, state)));
    double speed = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      speed = max(speed, abs(static_cast<double>(p.velocity[p.at(axis, slot)])));
    }
    atomicMax(&shared.fastest.particle, ordered_bits(speed));
    const Mat3<Real> gradient = load_gradient(p, slot);
    atomicMax(&shared.fastest.compression, ordered_bits(max(-static_cast<double>(trace(gradient)), 0.0)));
  }
  __syncthreads();
  if (threadIdx.x != 0) return;
  atomicMax(&fastest->sound, shared.fastest.sound);
  atomicMax(&fastest->particle, shared.fastest.particle);
  atomicMax(&fastest->compression, shared.fastest.compression);
}

template <class Real>
__global__ void count_unbroken(const Real* damage_root, unsigned count, unsigned* unbroken) {
  const unsigned slot = blockIdx.x * kThreads + threadIdx.x;
  const int mine = __syncthreads_count(slot < count && damage_root[slot] < Real(1) ? 1 : 0);
  if (threadIdx.x == 0 && mine > 0) atomicAdd(unbroken, static_cast<unsigned>(mine));
}

template <class Real>
__global__ void kick_velocities(PassArguments<Real> a, Vec3d uniform, double time, unsigned count) {
  const unsigned slot = blockIdx.x * kThreads + threadIdx.x;
  if (slot >= count) return;
  const ParticleView<Real>& p = a.particles;
  const double field[3] = {uniform.x, uniform.y, uniform.z};
  for (unsigned axis = 0; axis < 3; ++axis) {
    double g = field[axis];
    if (a.held_gravity) g += static_cast<double>(p.gravity[p.at(axis, slot)]);
    Real& v = p.velocity[p.at(axis, slot)];
    v = static_cast<Real>(static_cast<double>(v) - time * g);
  }
}

dim3 grid_for(unsigned items) { return {blocks_for(items, kThreads)}; }
void launched() { check(cudaGetLastError(), "launch of an observing kernel"); }

}  // namespace

template <class Real>
void launch_probe(const ProbeArguments<Real>& a, cudaStream_t stream) {
  if (a.pass.grid.tiles > 0) {
    BRECCIA_LAUNCH(probe_tiles<Real>, dim3(a.pass.grid.tiles), dim3(kThreads), 0, stream, a);
  }
  if (a.pass.lone > 0) BRECCIA_LAUNCH(probe_lone<Real>, grid_for(a.pass.lone), dim3(kThreads), 0, stream, a);
  launched();
}

void launch_total(const PassSums* sums, unsigned count, PassSums* total, cudaStream_t stream) {
  BRECCIA_LAUNCH(total_of, dim3(1), dim3(kThreads), sizeof(TotalShared), stream, sums, count, total);
  launched();
}

template <class Real>
void launch_kick(const PassArguments<Real>& a, const Vec3d& uniform, double time, unsigned count, cudaStream_t stream) {
  if (count == 0) return;
  BRECCIA_LAUNCH(kick_velocities<Real>, grid_for(count), dim3(kThreads), 0, stream, a, uniform, time, count);
  launched();
}

template <class Real>
void launch_signals(const PassArguments<Real>& a, const material::Constants<double>* materials, unsigned count,
                    FastestSignals* fastest, cudaStream_t stream) {
  if (count == 0) return;
  BRECCIA_LAUNCH(signals<Real>, grid_for(count), dim3(kThreads), sizeof(SignalShared), stream, a, materials, count,
                 fastest);
  launched();
}

template <class Real>
void launch_count_unbroken(const Real* damage_root, unsigned count, unsigned* unbroken, cudaStream_t stream) {
  if (count == 0) return;
  BRECCIA_LAUNCH(count_unbroken<Real>, grid_for(count), dim3(kThreads), 0, stream, damage_root, count, unbroken);
  launched();
}

#define BRECCIA_INSTANTIATE(Real)                                                                        \
  template void launch_probe(const ProbeArguments<Real>&, cudaStream_t);                                 \
  template void launch_kick(const PassArguments<Real>&, const Vec3d&, double, unsigned, cudaStream_t);   \
  template void launch_signals(const PassArguments<Real>&, const material::Constants<double>*, unsigned, \
                               FastestSignals*, cudaStream_t);                                           \
  template void launch_count_unbroken(const Real*, unsigned, unsigned*, cudaStream_t);
BRECCIA_INSTANTIATE(float)
BRECCIA_INSTANTIATE(double)
#undef BRECCIA_INSTANTIATE

}  // namespace breccia::cuda

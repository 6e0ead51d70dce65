// Masses to nodes, and from the potential at the nodes accelerations back, with the weights of gravity/mesh/tsc.hpp. A
// node gathers its masses from the bodies around it, always in the same order: nothing is added atomically.
#include "cuda/check.hpp"
#include "cuda/launchers.hpp"
#include "cuda/mesh_kernels.hpp"
#include "gravity/mesh/tsc.hpp"

namespace breccia::cuda {
namespace {

constexpr unsigned kThreads = 128;

__device__ __forceinline__ std::size_t thread_number() { return std::size_t{blockIdx.x} * kThreads + threadIdx.x; }

struct Index3 {
  int i, j, k;
};
__device__ __forceinline__ Index3 index_of(std::size_t n, int first_plane, int rows, int row) {
  const auto k = static_cast<int>(n % static_cast<std::size_t>(row));
  const std::size_t rest = n / static_cast<std::size_t>(row);
  return {first_plane + static_cast<int>(rest / static_cast<std::size_t>(rows)),
          static_cast<int>(rest % static_cast<std::size_t>(rows)), k};
}

// Of the node `offset` nodes from the one nearest to a body, which it is d away from.
template <class Real>
__device__ __forceinline__ Real weight(Real d, int offset) {
  return offset == 0 ? gravity::tsc_nearest<Real>(d) : gravity::tsc_beside<Real>(offset > 0 ? d : -d);
}

// Mass that node (i, j, k) has from the bodies nearest to the node (a, b, c) nodes from it.
template <class Real>
__device__ __forceinline__ Real mass_from(const MeshNodes& nodes, const MeshBodies& bodies, Index3 n, int a, int b,
                                          int c) {
  const unsigned key = nodes.key(n.i + a, n.j + b, n.k + c);
  Real sum(0);
  for (unsigned p = bodies.first[key]; p < bodies.first[key + 1]; ++p) {
    const Vec3d x = bodies.at(p);
    sum += static_cast<Real>(bodies.mass[p]) * weight(static_cast<Real>(x.x - (n.i + a)), -a) *
           weight(static_cast<Real>(x.y - (n.j + b)), -b) * weight(static_cast<Real>(x.z - (n.k + c)), -c);
  }
  return sum;
}

__device__ __forceinline__ bool inside(const MeshNodes& nodes, Index3 n, int edge) {
  return n.i >= edge && n.j >= edge && n.k >= edge && n.i < nodes.nodes[0] - edge && n.j < nodes.nodes[1] - edge &&
         n.k < nodes.nodes[2] - edge;
}

template <class Real>
__global__ void __launch_bounds__(kThreads) assign_masses(MeshNodes nodes, MeshBodies bodies, MeshPlanes<Real> masses) {
  const std::size_t at = thread_number();
  if (at >= masses.size()) return;
  const Index3 n = index_of(at, masses.begin, masses.rows, masses.row);
  Real sum(0);
  if (inside(nodes, n, 1)) {
    for (int a = -1; a <= 1; ++a) {
      for (int b = -1; b <= 1; ++b) {
        for (int c = -1; c <= 1; ++c) sum += mass_from<Real>(nodes, bodies, n, a, b, c);
      }
    }
  }
  masses.values[at] = sum;
}

__device__ __forceinline__ int folded(int wave_number, int padded) {
  return wave_number < padded - wave_number ? wave_number : padded - wave_number;
}

template <class Real>
__global__ void __launch_bounds__(kThreads) multiply(Spectrum<Real> s) {
  const std::size_t at = thread_number();
  const Index3 n = index_of(at, 0, s.rows, s.half);
  if (n.i >= s.padded[0]) return;
  const auto row = static_cast<std::size_t>(folded(s.first_row + n.j, s.padded[1]) - s.first_folded);
  const auto x_count = static_cast<std::size_t>(s.padded[0] / 2 + 1);
  const auto x = static_cast<std::size_t>(folded(n.i, s.padded[0]));
  const Real factor = s.kernel[(row * x_count + x) * static_cast<std::size_t>(s.half) + static_cast<std::size_t>(n.k)];
  s.values[2 * at] *= factor;
  s.values[2 * at + 1] *= factor;
}

template <class Real>
__global__ void __launch_bounds__(kThreads) take_nodes(MeshPlanes<Real> from, MeshPlanes<Real> to) {
  const std::size_t at = thread_number();
  if (at >= to.size()) return;
  const Index3 n = index_of(at, to.begin, to.rows, to.row);
  to.values[at] = from.values[from.at(n.i, n.j, n.k)];
}

// Differences between both sides of a node along an axis, f(-k) - f(k).
template <class Real>
__device__ __forceinline__ Real minus_derivative_at(const Real* f, std::size_t stride) {
  const auto pair = [&](std::size_t k) { return *(f - k * stride) - f[k * stride]; };
  return gravity::minus_derivative<Real>(pair(1), pair(2), pair(3));
}

template <class Real>
__global__ void __launch_bounds__(kThreads)
    differences(MeshNodes nodes, MeshPlanes<const Real> potential, NodeField<Real>* field) {
  const std::size_t at = thread_number();
  const Index3 n = index_of(at, 0, nodes.nodes[1], nodes.nodes[2]);
  if (!inside(nodes, n, 3)) return;
  const Real* f = potential.values + potential.at(n.i, n.j, n.k);
  const auto row = static_cast<std::size_t>(potential.row);
  field[at] = {{minus_derivative_at(f, row * static_cast<std::size_t>(potential.rows)), minus_derivative_at(f, row),
                minus_derivative_at(f, std::size_t{1})}};
}

template <class Real>
__global__ void __launch_bounds__(kThreads)
    interpolate(MeshNodes nodes, MeshBodies bodies, const NodeField<Real>* field, double unit, double* acceleration,
                unsigned own) {
  const std::size_t p = thread_number();
  if (p >= bodies.count || bodies.target[p] == kNoTarget) return;
  const Vec3d x = bodies.at(static_cast<unsigned>(p));
  const Index3 n{static_cast<int>(x.x + 0.5), static_cast<int>(x.y + 0.5), static_cast<int>(x.z + 0.5)};
  const Vec3<Real> d{static_cast<Real>(x.x - n.i), static_cast<Real>(x.y - n.j), static_cast<Real>(x.z - n.k)};
  Vec3<Real> sum{};
  for (int a = -1; a <= 1; ++a) {
    for (int b = -1; b <= 1; ++b) {
      const Real across = weight(d.x, a) * weight(d.y, b);
      const std::size_t row = (static_cast<std::size_t>(n.i + a) * static_cast<std::size_t>(nodes.nodes[1]) +
                               static_cast<std::size_t>(n.j + b)) *
                              static_cast<std::size_t>(nodes.nodes[2]);
      for (int c = -1; c <= 1; ++c) {
        sum += (across * weight(d.z, c)) * field[row + static_cast<std::size_t>(n.k + c)].acceleration;
      }
    }
  }
  const unsigned to = bodies.target[p];
  acceleration[to] += unit * static_cast<double>(sum.x);
  acceleration[own + to] += unit * static_cast<double>(sum.y);
  acceleration[2 * std::size_t{own} + to] += unit * static_cast<double>(sum.z);
}

dim3 threads_for(std::size_t items) { return {static_cast<unsigned>((items + kThreads - 1) / kThreads)}; }
void launched() { check(cudaGetLastError(), "launch of a kernel of the particle mesh"); }

std::size_t count_of(const MeshNodes& nodes) {
  return static_cast<std::size_t>(nodes.nodes[0]) * static_cast<std::size_t>(nodes.nodes[1]) *
         static_cast<std::size_t>(nodes.nodes[2]);
}

}  // namespace

template <class Real>
void launch_assign_masses(const MeshNodes& nodes, const MeshBodies& bodies, const MeshPlanes<Real>& masses,
                          cudaStream_t stream) {
  if (masses.size() == 0) return;
  BRECCIA_LAUNCH(assign_masses<Real>, threads_for(masses.size()), dim3(kThreads), 0, stream, nodes, bodies, masses);
  launched();
}

template <class Real>
void launch_multiply(const Spectrum<Real>& s, cudaStream_t stream) {
  const std::size_t values =
      static_cast<std::size_t>(s.padded[0]) * static_cast<std::size_t>(s.rows) * static_cast<std::size_t>(s.half);
  if (values == 0) return;
  BRECCIA_LAUNCH(multiply<Real>, threads_for(values), dim3(kThreads), 0, stream, s);
  launched();
}

template <class Real>
void launch_take_nodes(const MeshPlanes<Real>& from, const MeshPlanes<Real>& to, cudaStream_t stream) {
  if (to.size() == 0) return;
  BRECCIA_LAUNCH(take_nodes<Real>, threads_for(to.size()), dim3(kThreads), 0, stream, from, to);
  launched();
}

template <class Real>
void launch_differences(const MeshNodes& nodes, const MeshPlanes<const Real>& potential, NodeField<Real>* field,
                        cudaStream_t stream) {
  BRECCIA_LAUNCH(differences<Real>, threads_for(count_of(nodes)), dim3(kThreads), 0, stream, nodes, potential, field);
  launched();
}

template <class Real>
void launch_interpolate(const MeshNodes& nodes, const MeshBodies& bodies, const NodeField<Real>* field, double unit,
                        double* acceleration, unsigned own, cudaStream_t stream) {
  BRECCIA_LAUNCH(interpolate<Real>, threads_for(bodies.count), dim3(kThreads), 0, stream, nodes, bodies, field, unit,
                 acceleration, own);
  launched();
}

#define BRECCIA_MESH_KERNELS(Real)                                                                                     \
  template void launch_assign_masses<Real>(const MeshNodes&, const MeshBodies&, const MeshPlanes<Real>&,               \
                                           cudaStream_t);                                                              \
  template void launch_multiply<Real>(const Spectrum<Real>&, cudaStream_t);                                            \
  template void launch_take_nodes<Real>(const MeshPlanes<Real>&, const MeshPlanes<Real>&, cudaStream_t);               \
  template void launch_differences<Real>(const MeshNodes&, const MeshPlanes<const Real>&, NodeField<Real>*,            \
                                         cudaStream_t);                                                                \
  template void launch_interpolate<Real>(const MeshNodes&, const MeshBodies&, const NodeField<Real>*, double, double*, \
                                         unsigned, cudaStream_t);
BRECCIA_MESH_KERNELS(float)
BRECCIA_MESH_KERNELS(double)
#undef BRECCIA_MESH_KERNELS

}  // namespace breccia::cuda

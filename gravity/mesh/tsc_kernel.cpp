// Triangular-shaped cloud: masses to nodes, fields to particles, with the same weights.
#include "breccia/pack.hpp"
#include "gravity/mesh/mesh_kernels.hpp"
#include "gravity/mesh/tsc.hpp"

namespace breccia::gravity::BRECCIA_ISA {
namespace {

// The 3^3 nodes around each particle of a cluster: index of the lowest one and weights along the axes.
template <class Real>
struct Stencil {
  std::int64_t first[kClusterSize];
  Real weight[3][3][kClusterSize];
};

/// The integer next to x, for |x| < 2^21: adding a number that leaves no bits for the fraction rounds.
template <class V>
BRECCIA_HD V nearest(V x) {
  using Real = typename V::Scalar;
  const V large(sizeof(Real) == 4 ? Real(12582912.0) : Real(6755399441055744.0));
  return (x + large) - large;
}

template <class Real>
BRECCIA_HD void make_stencil(const ClusterArrays<Real>& particles, std::int64_t cluster, int first_plane, int ny,
                             int nz, Stencil<Real>& stencil) {
  using V = Pack<Real, kClusterSize>;
  const std::int64_t stride[3] = {static_cast<std::int64_t>(ny) * nz, nz, 1};
  for (std::int64_t l = 0; l < kClusterSize; ++l) stencil.first[l] = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto base = static_cast<std::int64_t>(particles.centre[axis][cluster]);
    // The fraction of the centre is exact, the sum is small: no bits of the position are lost.
    const V x = V::load(particles.offset[axis] + cluster * kClusterSize) +
                V(particles.centre[axis][cluster] - static_cast<Real>(base));
    const V node = nearest(x);
    const V d = x - node;
    tsc_beside<Real>(-d).store(stencil.weight[axis][0]);
    tsc_nearest<Real>(d).store(stencil.weight[axis][1]);
    tsc_beside<Real>(d).store(stencil.weight[axis][2]);
    Real nodes[kClusterSize];
    node.store(nodes);
    const std::int64_t lowest = base - 1 - (axis == 0 ? first_plane : 0);
    for (std::int64_t l = 0; l < kClusterSize; ++l) {
      stencil.first[l] += stride[axis] * (lowest + static_cast<std::int64_t>(nodes[l]));
    }
  }
}

template <class Real>
void assign_as(const AssignTask<Real>& task) {
  using Row = Pack<Real, 4>;
  const std::int64_t plane = static_cast<std::int64_t>(task.ny) * task.nz;
  Stencil<Real> stencil;
  for (std::int64_t c = task.begin; c < task.end; ++c) {
    make_stencil(task.particles, c, task.first_plane, task.ny, task.nz, stencil);
    for (std::int64_t l = 0; l < kClusterSize; ++l) {
      const Real mass = task.particles.mass[c * kClusterSize + l];
      Row row(Real(0));
      for (int k = 0; k < 3; ++k) row.set(k, mass * stencil.weight[2][k][l]);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          Real* nodes = task.mesh + stencil.first[l] + i * plane + j * task.nz;
          (Row::load(nodes) + Row(stencil.weight[0][i][l] * stencil.weight[1][j][l]) * row).store(nodes);
        }
      }
    }
  }
}

template <class Real>
void interpolate_as(const InterpolateTask<Real>& task) {
  // Four nodes of four values; the fourth node has weight 0.
  using Row = Pack<Real, 16>;
  using Node = Pack<Real, 4>;
  const std::int64_t plane = static_cast<std::int64_t>(task.ny) * task.nz;
  Stencil<Real> stencil;
  for (std::int64_t c = task.begin; c < task.end; ++c) {
    make_stencil(task.particles, c, task.first_plane, task.ny, task.nz, stencil);
    for (std::int64_t l = 0; l < kClusterSize; ++l) {
      Row sum(Real(0));
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          const Real* nodes = task.field + 4 * (stencil.first[l] + i * plane + j * task.nz);
          sum += Row(stencil.weight[0][i][l] * stencil.weight[1][j][l]) * Row::load(nodes);
        }
      }
      const Node value = lower(lower(sum)) * Node(stencil.weight[2][0][l]) +
                         upper(lower(sum)) * Node(stencil.weight[2][1][l]) +
                         lower(upper(sum)) * Node(stencil.weight[2][2][l]);
      for (int k = 0; k < 4; ++k) task.result[k][c * kClusterSize + l] += value[k];
    }
  }
}

template <class V>
BRECCIA_HD V minus_derivative_at(const typename V::Scalar* at, std::int64_t stride) {
  using Real = typename V::Scalar;
  const auto pair = [&](std::int64_t k)
                        BRECCIA_INLINE_LAMBDA { return V::load(at - k * stride) - V::load(at + k * stride); };
  return minus_derivative<Real>(pair(1), pair(2), pair(3));
}

template <class Real>
void differences_as(const DifferenceTask<Real>& task) {
  using V = Pack<Real, 16>;
  const std::int64_t plane = static_cast<std::int64_t>(task.ny) * task.nz;
  for (int x = task.begin; x < task.end; ++x) {
    for (int y = 3; y < task.ny - 3; ++y) {
      for (int z = 3; z < task.nz - 3; z += V::kLanes) {
        // The last pack of a row overlaps the one before.
        const int last = task.nz - 3 - V::kLanes;
        const int from = z < last ? z : last;
        const Real* at = task.potential + (x + 3) * plane + static_cast<std::int64_t>(y) * task.nz + from;
        Real values[4][V::kLanes];
        minus_derivative_at<V>(at, plane).store(values[0]);
        minus_derivative_at<V>(at, task.nz).store(values[1]);
        minus_derivative_at<V>(at, 1).store(values[2]);
        V::load(at).store(values[3]);
        Real* to = task.field + 4 * (x * plane + static_cast<std::int64_t>(y) * task.nz + from);
        for (int l = 0; l < V::kLanes; ++l) {
          for (int k = 0; k < 4; ++k) to[4 * l + k] = values[k][l];
        }
      }
    }
  }
}

}  // namespace

void assign_masses(const AssignTask<float>& task) { assign_as(task); }
void assign_masses(const AssignTask<double>& task) { assign_as(task); }
void take_differences(const DifferenceTask<float>& task) { differences_as(task); }
void take_differences(const DifferenceTask<double>& task) { differences_as(task); }
void interpolate(const InterpolateTask<float>& task) { interpolate_as(task); }
void interpolate(const InterpolateTask<double>& task) { interpolate_as(task); }

}  // namespace breccia::gravity::BRECCIA_ISA

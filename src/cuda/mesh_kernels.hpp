// The particle mesh of a box on the device: its bodies in the order of its nodes, masses to nodes, accelerations back,
// and the pairs closer than the cutoff. Lengths in mesh cells from node 0, masses in the caller's unit
// (gravity.md 5.3).
#pragma once

#include <cstdint>

#include "cuda/gravity_kernels.hpp"
#include "gravity/mesh/box.hpp"
#include "gravity/mesh/split.hpp"

namespace breccia::cuda {

struct BoxList {
  gravity::Box box[gravity::kMostBoxes];
  std::size_t count = 0;
};
/// keys[i] := gravity::set_of(), order[i] := i of the bodies.
void launch_set_keys(const BodyArrays& bodies, const BoxList& boxes, std::uint64_t* keys, unsigned* order,
                     cudaStream_t stream);
/// to[4][count] := positions and masses in that order.
void launch_gather_bodies(const BodyArrays& bodies, const unsigned* order, double* to, cudaStream_t stream);

/// Nodes of a mesh and their order: columns of column x column nodes along z, node after node in each layer of them.
/// Bodies sorted by their nearest node so are sorted by columns, and in each by z.
struct MeshNodes {
  Vec3d origin{};       ///< of node (0, 0, 0) [m]
  double per_cell = 1;  ///< cells per metre
  int nodes[3] = {};    ///< along the axes
  int column = 1;       ///< nodes across a column
  int columns[2] = {};  ///< along x and y
  [[nodiscard]] BRECCIA_HD unsigned of_column() const { return static_cast<unsigned>(nodes[2] * column * column); }
  [[nodiscard]] BRECCIA_HD unsigned column_count() const { return static_cast<unsigned>(columns[0] * columns[1]); }
  [[nodiscard]] BRECCIA_HD unsigned key_count() const { return column_count() * of_column(); }
  [[nodiscard]] BRECCIA_HD unsigned key(int i, int j, int k) const {
    const int at = (i / column) * columns[1] + j / column;
    const int within = (k * column + i % column) * column + j % column;
    return static_cast<unsigned>(at) * of_column() + static_cast<unsigned>(within);
  }
};

/// Of MeshBodies::target: the body is another rank's.
inline constexpr unsigned kNoTarget = ~0U;

/// Bodies in the order of their nodes.
struct MeshBodies {
  double* position[3] = {nullptr, nullptr, nullptr};  ///< [cells]
  double* mass = nullptr;                             ///< [mass unit]
  unsigned* target = nullptr;                         ///< place of its acceleration, or kNoTarget
  unsigned count = 0;
  const unsigned* first = nullptr;  ///< [keys + 1] of each node
  [[nodiscard]] BRECCIA_HD Vec3d at(unsigned i) const { return {position[0][i], position[1][i], position[2][i]}; }
};
/// keys[i] and order[i] := i.
void launch_mesh_keys(const BodyArrays& bodies, const MeshNodes& nodes, std::uint64_t* keys, unsigned* order,
                      cudaStream_t stream);
/// Fills `to` in that order; of the bodies of all ranks [first, first + own) are this rank's.
void launch_arrange_in_mesh(const BodyArrays& bodies, const MeshNodes& nodes, double mass_unit, unsigned first,
                            unsigned own, const unsigned* order, const MeshBodies& to, cudaStream_t stream);

/// Bodies that a warp takes at once, neighbours in a column.
inline constexpr unsigned kClusterBodies = 32;
template <class Real>
struct Cluster {
  Real centre[3];
  Real half[3];
  unsigned begin, end;  ///< bodies
};
template <class Real>
struct Clusters {
  unsigned* first = nullptr;         ///< [columns + 1] of each column
  Cluster<Real>* cluster = nullptr;  ///< [most]
  unsigned most = 0;                 ///< there are no more
};
/// clusters.first[c] := number of clusters of column c, 0 after the last.
template <class Real>
void launch_count_clusters(const MeshNodes& nodes, const MeshBodies& bodies, const Clusters<Real>& clusters,
                           cudaStream_t stream);
/// Bounds of all clusters, once their numbers are scanned.
template <class Real>
void launch_bound_clusters(const MeshNodes& nodes, const MeshBodies& bodies, const Clusters<Real>& clusters,
                           cudaStream_t stream);

/// Adds the short-range sums times `unit` to acceleration[3][own]; `pairs` counts them.
template <class Real>
struct NearArguments {
  MeshNodes nodes;
  MeshBodies bodies;
  Clusters<Real> clusters;
  gravity::ShortRange<Real> law;
  double unit = 1;
  double* acceleration = nullptr;
  unsigned own = 0;
  unsigned long long* pairs = nullptr;
};
template <class Real>
void launch_sum_near(const NearArguments<Real>& a, cudaStream_t stream);

/// Planes of x of the doubled mesh in rows of `row` reals along z, `rows` in a plane.
template <class Real>
struct MeshPlanes {
  Real* values = nullptr;
  int begin = 0, end = 0;  ///< planes
  int rows = 0, row = 0;
  [[nodiscard]] BRECCIA_HD std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(i - begin) * static_cast<std::size_t>(rows) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(row) +
           static_cast<std::size_t>(k);
  }
  [[nodiscard]] BRECCIA_HD std::size_t size() const {
    return static_cast<std::size_t>(end - begin) * static_cast<std::size_t>(rows) * static_cast<std::size_t>(row);
  }
};
/// Masses at the nodes, by TSC weights; zero beyond them.
template <class Real>
void launch_assign_masses(const MeshNodes& nodes, const MeshBodies& bodies, const MeshPlanes<Real>& masses,
                          cudaStream_t stream);

/// What a wave number of the doubled mesh is multiplied by; the kernel's octant as gravity::transformed_kernel() has
/// it.
template <class Real>
struct Spectrum {
  Real* values = nullptr;  ///< complex (x wave numbers, `rows` y wave numbers from first_row on, half)
  const Real* kernel = nullptr;
  int padded[2] = {};  ///< along x and y
  int half = 0;        ///< complex numbers along z
  int first_row = 0, rows = 0;
  int first_folded = 0;  ///< of the kernel's rows
};
template <class Real>
void launch_multiply(const Spectrum<Real>& spectrum, cudaStream_t stream);

/// The nodes' part of planes, without what lies beyond.
template <class Real>
void launch_take_nodes(const MeshPlanes<Real>& from, const MeshPlanes<Real>& to, cudaStream_t stream);

template <class Real>
struct alignas(4 * sizeof(Real)) NodeField {
  Vec3<Real> acceleration;
};
/// Accelerations at all nodes that bodies feel, from the potential at all of them; field[nodes].
template <class Real>
void launch_differences(const MeshNodes& nodes, const MeshPlanes<const Real>& potential, NodeField<Real>* field,
                        cudaStream_t stream);
/// Adds what the bodies feel from the nodes, times `unit`, to acceleration[3][own].
template <class Real>
void launch_interpolate(const MeshNodes& nodes, const MeshBodies& bodies, const NodeField<Real>* field, double unit,
                        double* acceleration, unsigned own, cudaStream_t stream);

}  // namespace breccia::cuda

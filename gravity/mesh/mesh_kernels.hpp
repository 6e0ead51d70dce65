// The loops of the particle mesh over particles and nodes, compiled once per instruction set. Lengths in cells, masses
// in the caller's unit; results in that unit over cell (potential) and over cell^2 (acceleration).
#pragma once

#include "gravity/mesh/cluster_arrays.hpp"
#include "gravity/mesh/split.hpp"

namespace breccia::gravity {

/// Least nodes along an axis.
inline constexpr int kLeastNodes = 24;

/// Adds the masses of clusters [begin, end) to mesh nodes by TSC weights.
template <class Real>
struct AssignTask {
  ClusterArrays<Real> particles;
  std::int64_t begin, end;
  Real* mesh;       ///< (planes from first_plane on, ny, nz), and 1 value more
  int first_plane;  ///< x index of the first plane in `mesh`
  int ny, nz;
};

/// Accelerations and potential on nodes from the potential, by 6-point differences.
template <class Real>
struct DifferenceTask {
  const Real* potential;  ///< (3 planes before `begin` to 3 planes after `end`, ny, nz)
  Real* field;            ///< (planes, ny, nz, 4): acceleration and potential; 3 nodes from the faces of y, z on
  int begin, end;         ///< planes of `field` to be written, counted from its first
  int ny, nz;             ///< nz >= kLeastNodes
};

/// Adds what clusters [begin, end) feel from the nodes, by the weights of the assignment.
template <class Real>
struct InterpolateTask {
  ClusterArrays<Real> particles;
  std::int64_t begin, end;
  const Real* field;  ///< as in DifferenceTask, from first_plane on, and 4 values more
  int first_plane;
  int ny, nz;
  Real* result[4];  ///< acceleration and potential of each slot
};

/// Adds the short-range sums over all sources inside the cutoff to clusters [begin, end). A particle without softening
/// does not feel those closer than about 1e-6 cells (itself among them).
template <class Real>
struct NearTask {
  ClusterArrays<Real> targets;
  std::int64_t begin, end;
  ClusterArrays<Real> sources;
  ClusterColumns columns;  ///< of the sources
  const ShortRange<Real>* law;
  Real* result[4];      ///< acceleration and potential of each target slot; potential null: not wanted
  std::int64_t* pairs;  ///< of each target cluster: sources summed over are added here
};

#define BRECCIA_DECLARE_MESH_KERNELS(Real)            \
  void assign_masses(const AssignTask<Real>&);        \
  void take_differences(const DifferenceTask<Real>&); \
  void interpolate(const InterpolateTask<Real>&);     \
  void sum_near(const NearTask<Real>&);

namespace isa_v2 {
BRECCIA_DECLARE_MESH_KERNELS(float)
BRECCIA_DECLARE_MESH_KERNELS(double)
}  // namespace isa_v2
namespace isa_v3 {
BRECCIA_DECLARE_MESH_KERNELS(float)
BRECCIA_DECLARE_MESH_KERNELS(double)
}  // namespace isa_v3
namespace isa_v4 {
BRECCIA_DECLARE_MESH_KERNELS(float)
BRECCIA_DECLARE_MESH_KERNELS(double)
}  // namespace isa_v4

// The copies this processor runs fastest (breccia::active_isa).
BRECCIA_DECLARE_MESH_KERNELS(float)
BRECCIA_DECLARE_MESH_KERNELS(double)

#undef BRECCIA_DECLARE_MESH_KERNELS

}  // namespace breccia::gravity

// The long-range field of one box: masses to nodes, potential, differences, back to the particles (gravity.md 5.3).
#pragma once

#include <memory>
#include <vector>

#include "gravity/mesh/clusters.hpp"
#include "gravity/mesh/convolution.hpp"
#include "gravity/mesh/geometry.hpp"
#include "gravity/mesh/phases.hpp"
#include "gravity/mesh/split.hpp"

namespace breccia::gravity {

/// Acceleration and potential of each slot of the clusters, [mass unit / cell^2] and [mass unit / cell].
template <class Real>
using SlotField = std::array<AlignedVector<Real>, 4>;

/// Which ranks transform a mesh.
struct MeshSharing {
  double replicated_nodes = 1e6;  ///< meshes of up to so many nodes, doubled, each rank transforms for itself
  int least_planes = 4;           ///< of larger ones each rank has as many, or none: fewer cost more to send than to do
};

/// Potential of the split, in cells, without the smearing that TSC assignment and interpolation add.
Kernel mesh_kernel(const GaussianSplit& split);

/// A mesh of one size.
template <class Real>
class BoxMesh {
 public:
  /// `split` in cells. Collective.
  BoxMesh(const MeshSize& size, const GaussianSplit& split, const mpi::Comm& comm, int threads,
          const MeshSharing& sharing = {});
  ~BoxMesh();
  BoxMesh(const BoxMesh&) = delete;
  BoxMesh& operator=(const BoxMesh&) = delete;

  [[nodiscard]] const MeshSize& size() const { return size_; }

  /// Adds the field of the masses of all ranks to that of the own particles. Collective; a rank may have none.
  void add_field(const Clusters<Real>& own, SlotField<Real>& field, Phases& phases);

 private:
  void assign(const Clusters<Real>& own);
  void exchange_and_convolve(Phases& phases);
  void interpolate_to(const Clusters<Real>& own, SlotField<Real>& field);

  [[nodiscard]] std::size_t plane() const {
    return static_cast<std::size_t>(size_.nodes[1]) * static_cast<std::size_t>(size_.nodes[2]);
  }

  MeshSize size_;
  mpi::Comm comm_;
  int threads_;
  MPI_Comm transformers_ = MPI_COMM_NULL;  // the ranks that transform this mesh together; null on the others
  std::unique_ptr<Convolution<Real>> convolution_;
  std::vector<PlaneRange> owners_;
  PlaneRange touched_;             // planes the own particles reach
  AlignedVector<Real> mass_;       // on touched_
  AlignedVector<Real> owned_;      // mass, then potential, on the planes this rank transforms
  AlignedVector<Real> potential_;  // on touched_ and 3 planes on both sides
  AlignedVector<Real> nodes_;      // acceleration and potential on touched_
};

}  // namespace breccia::gravity

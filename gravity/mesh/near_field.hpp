// The short-range field of one box: pairs inside the cutoff, on this rank and with the halo of the others.
#pragma once

#include <span>

#include "gravity/mesh/box_mesh.hpp"

namespace breccia::gravity {

template <class Real>
class NearField {
 public:
  NearField(const mpi::Comm& comm, int threads) : comm_(comm), threads_(threads) {}

  /// Pairs that each particle of a cluster took part in.
  [[nodiscard]] const std::vector<std::int64_t>& pairs_of_clusters() const { return pairs_; }

  /// Adds the sums to the field of the own particles, given as clusters and in the order of their arrays; positions in
  /// cells, `spacing` as for Clusters. Returns the pairs evaluated. Collective; a rank may have none.
  double add_field(const Clusters<Real>& own, std::span<const Vec3d> position, std::span<const double> mass,
                   double spacing, const ShortRange<Real>& law, bool with_potential, SlotField<Real>& field,
                   Phases& phases);

 private:
  void fetch_halo(std::span<const Vec3d> position, std::span<const double> mass, double cutoff, double spacing,
                  Phases& phases);
  void add_from(const Clusters<Real>& sources, const Clusters<Real>& own, const ShortRange<Real>& law,
                bool with_potential, SlotField<Real>& field);

  mpi::Comm comm_;
  int threads_;
  std::vector<Vec3d> halo_position_;
  std::vector<double> halo_mass_;
  std::vector<std::int64_t> pairs_;
  Clusters<Real> halo_;
};

}  // namespace breccia::gravity

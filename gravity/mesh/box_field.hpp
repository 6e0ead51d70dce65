// What the particles of one box do to each other: long-range part from a mesh, short-range part from pairs.
#pragma once

#include <memory>
#include <span>

#include "gravity/evaluation.hpp"
#include "gravity/mesh/box_mesh.hpp"
#include "gravity/mesh/near_field.hpp"

namespace breccia::gravity {

struct BoxSettings {
  Box box;
  double cell;          ///< of the mesh [m]
  double spacing;       ///< mean distance of the particles where they are dense [m]
  GaussianSplit split;  ///< [cells]
  double mass_unit;     ///< [kg]
};

template <class Real>
class BoxField {
 public:
  BoxField(const mpi::Comm& comm, int threads) : comm_(comm), threads_(threads), near_(comm, threads) {}

  /// Adds the field [m/s2, J/kg] of the particles whose set is `number` to those of them on this rank. The mesh and
  /// its kernel are kept while size and settings stay. Collective.
  void add_to(ParticlesView particles, std::span<const std::uint8_t> set, std::uint8_t number,
              const BoxSettings& settings, const FieldView& field, Stats& stats);

 private:
  void select(ParticlesView particles, std::span<const std::uint8_t> set, std::uint8_t number,
              const MeshGeometry& geometry, double mass_unit);
  void prepare_mesh(const MeshGeometry& geometry, const GaussianSplit& split);
  void write(const BoxSettings& settings, const FieldView& field) const;

  mpi::Comm comm_;
  int threads_;
  std::vector<std::size_t> index_;  // of the box's particles in the caller's arrays
  std::vector<Vec3d> position_;     // [cells]
  std::vector<double> mass_;        // [mass unit]
  Clusters<Real> clusters_;
  SlotField<Real> field_;
  NearField<Real> near_;
  GaussianSplit split_;
  ShortRange<Real> law_{};
  std::unique_ptr<BoxMesh<Real>> mesh_;
};

}  // namespace breccia::gravity

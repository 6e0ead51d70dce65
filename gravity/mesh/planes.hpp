// Mesh planes on their way between the ranks that hold particles and those that transform the mesh.
#pragma once

#include <span>
#include <vector>

#include "gravity/mesh/convolution.hpp"

namespace breccia::gravity {

/// Planes of `plane` values each that one rank holds.
template <class Real>
struct PlaneStack {
  PlaneRange range;
  Real* values;
};

/// Adds each rank's planes `mine` to the copies that the ranks `owners` hold of them (one range for each rank, they may
/// overlap), in the order of the ranks; what `owned` held before is lost. Returns the bytes sent. Collective.
template <class Real>
double add_to_owners(PlaneStack<const Real> mine, std::span<const PlaneRange> owners, PlaneStack<Real> owned,
                     std::size_t plane, const mpi::Comm& comm);

/// Fills `mine` from the owners. Each plane is owned by one rank, or every rank owns all. Returns the bytes sent.
/// Collective.
template <class Real>
double fetch_from_owners(PlaneStack<const Real> owned, std::span<const PlaneRange> owners, PlaneStack<Real> mine,
                         std::size_t plane, const mpi::Comm& comm);

}  // namespace breccia::gravity

// What `auto` gravity stands for on devices: the method that takes the least time, counted from what there is to sum
// and from rates of the device.
#pragma once

#include "gravity/method.hpp"

namespace breccia::cuda {

/// What a device does in a second, by its precision. Measured on an H100 (docs/gpu.md), by 94,648 and 1e6 particles in
/// spheres, an elongated body with debris, and fragments; a tree takes the more launches the more its depths differ, 3
/// to 11 ms, of which this is the middle.
struct DeviceRates {
  double direct_pairs;  ///< of the direct sum [1/s]
  double tree_pairs;    ///< of groups and near clusters: lists to follow, lanes without a target [1/s]
  double tree_bodies;   ///< keys, sorting, cells and moments of bodies [1/s]
  double mesh_nodes;    ///< of the mesh, not doubled: three transforms there and back [1/s]
  double host_bodies;   ///< of which the host chooses the boxes, on one core, copies included [1/s]
  double tree_seconds;  ///< the host's waits and launches for a tree [s]
  double box_seconds;   ///< and for a box [s]
};
template <class Real>
inline constexpr DeviceRates kDeviceRates{.direct_pairs = 1.4e12,
                                          .tree_pairs = 4e11,
                                          .tree_bodies = 5e8,
                                          .mesh_nodes = 5e9,
                                          .host_bodies = 1.5e7,
                                          .tree_seconds = 7e-3,
                                          .box_seconds = 5e-4};
template <>
inline constexpr DeviceRates kDeviceRates<double>{.direct_pairs = 6e11,
                                                  .tree_pairs = 1e11,
                                                  .tree_bodies = 5e8,
                                                  .mesh_nodes = 2.5e9,
                                                  .host_bodies = 1.5e7,
                                                  .tree_seconds = 1.2e-2,
                                                  .box_seconds = 5e-4};

/// Seconds of an evaluation by each method.
struct GravitySeconds {
  double direct = 0.0, tree = 0.0, mesh = 0.0;
};
/// `ranks` devices share the work; each builds the whole tree.
GravitySeconds gravity_seconds(const gravity::Matter& matter, const gravity::Parameters& parameters,
                               const DeviceRates& rates, int ranks);

/// True if the choice depends on where the matter is: the mesh might be cheaper than the tree, or the tree might
/// disturb dense bodies too much. Where it is false, cheapest_on_device() needs to know the number of particles only.
bool choice_needs_boxes(std::uint64_t particles, const gravity::Parameters& parameters, const DeviceRates& rates,
                        int ranks);

/// The method that takes the least time of those that are right to Parameters::error and disturb no dense body more
/// than gravity::kBodyTolerance allows, as gravity::cheapest_method() for the host.
gravity::MethodChoice cheapest_on_device(const gravity::Matter& matter, const gravity::Parameters& parameters,
                                         const DeviceRates& rates, int ranks);

}  // namespace breccia::cuda

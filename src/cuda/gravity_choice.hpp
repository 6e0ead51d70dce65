// What `auto` gravity stands for on devices: the method that takes the least time, counted from what there is to sum
// and from rates of the device.
#pragma once

#include "gravity/method.hpp"

namespace breccia::cuda {

/// What a device does in a second, by its precision. Measured on an H100 (docs/gpu.md), by 94,648 and 1e6 particles in
/// spheres, an elongated body with debris, and fragments; a tree takes the more launches the more its depths differ, 3
/// to 11 ms, of which this is the middle. Those of laying boxes are counted, not measured: the host's choice takes 0.3
/// to 1.6 ms of one core and waits seven times, the device reads each body four times and adds to eight numbers for it.
struct DeviceRates {
  double direct_pairs;  ///< of the direct sum [1/s]
  double tree_pairs;    ///< of groups and near clusters: lists to follow, lanes without a target [1/s]
  double tree_bodies;   ///< keys, sorting, cells and moments of bodies [1/s]
  double mesh_nodes;    ///< of the mesh, not doubled: three transforms there and back [1/s]
  double block_bodies;  ///< counted in blocks of space, for the choice of boxes [1/s]
  double lay_seconds;   ///< the host's choice of them from those counts, its waits and launches [s]
  double tree_seconds;  ///< its waits and launches for a tree [s]
  double box_seconds;   ///< and for a box [s]
};
template <class Real>
inline constexpr DeviceRates kDeviceRates{.direct_pairs = 1.4e12,
                                          .tree_pairs = 4e11,
                                          .tree_bodies = 5e8,
                                          .mesh_nodes = 5e9,
                                          .block_bodies = 2e9,
                                          .lay_seconds = 1e-3,
                                          .tree_seconds = 7e-3,
                                          .box_seconds = 5e-4};
template <>
inline constexpr DeviceRates kDeviceRates<double>{.direct_pairs = 6e11,
                                                  .tree_pairs = 1e11,
                                                  .tree_bodies = 5e8,
                                                  .mesh_nodes = 2.5e9,
                                                  .block_bodies = 2e9,
                                                  .lay_seconds = 1e-3,
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

#include "cuda/device_plan.hpp"

#include <cmath>

#include "cuda/device_load.hpp"
#include "cuda/device_particles.hpp"
#include "cuda/gravity_choice.hpp"
#include "gravity/tree/tolerance.hpp"
#include "grid/boundary.hpp"
#include "grid/setup_choices.hpp"

namespace breccia::cuda {
namespace {

template <class P>
std::uint64_t engine_bytes(const DevicePlan& plan) {
  const grid::BoundarySet boundaries(plan.setup.boundaries, plan.setup.cell);
  Load load = count_load(plan.sample, plan.flaws, boundaries.periodicity(),
                         plan.setup.numerics.lone_without_grid && !boundaries.has_walls(), {});
  for (std::uint64_t* count : {&load.particles, &load.lone, &load.tiles, &load.blocks, &load.flaws}) {
    *count = static_cast<std::uint64_t>(std::ceil(static_cast<double>(*count) * plan.scale / plan.ranks));
  }
  return bytes_needed<P>(DeviceParticles<P>(grid::groups_for(plan.setup)).record_bytes(), load);
}

template <class Real>
std::uint64_t gravity_bytes(const DevicePlan& plan) {
  if (plan.gravity == GravityMethod::kOff) return 0;
  const GravityMethod method =
      plan.gravity != GravityMethod::kAuto
          ? plan.gravity
          : cheapest_on_device(plan.matter, plan.parameters, kDeviceRates<Real>, plan.ranks).method;
  const std::uint64_t all = plan.matter.particles;
  const bool seeks_boxes = plan.gravity == GravityMethod::kTreePm ||
                           (plan.gravity == GravityMethod::kAuto &&
                            choice_needs_boxes(all, plan.parameters, kDeviceRates<Real>, plan.ranks));
  const auto ranks = static_cast<std::uint64_t>(plan.ranks);
  return bytes_for_gravity<Real>(method, {.own = (all + ranks - 1) / ranks,
                                          .all = all,
                                          .ranks = plan.ranks,
                                          .seeks_boxes = seeks_boxes,
                                          .opening = gravity::opening_for(plan.parameters, static_cast<double>(all)),
                                          .boxes = plan.boxes});
}

}  // namespace

DeviceMemory memory_of(const DevicePlan& plan) {
  if (plan.setup.numerics.precision == Precision::kDouble) {
    return {engine_bytes<DoublePrecision>(plan), gravity_bytes<double>(plan)};
  }
  return {engine_bytes<MixedPrecision>(plan), gravity_bytes<float>(plan)};
}

}  // namespace breccia::cuda

// What the engine says of a particle that went wrong.
#include <algorithm>
#include <cmath>

#include "grid/host_engine.hpp"

namespace breccia::grid {

template <class P>
ParticleSample HostEngine<P>::sample(std::size_t slot, BlockCoord block) const {
  const std::size_t pack = slot / kLanes;
  const int lane = static_cast<int>(slot % kLanes);
  const auto& velocity = store_.kinematics[pack].velocity;
  ParticleSample s;
  s.id = id(slot);
  s.position = position(slot, block);
  s.values.velocity = {velocity[0][lane], velocity[1][lane], velocity[2][lane]};
  s.values.volume_ratio = 1.0 + static_cast<double>(store_.volume[pack].change.value()[lane]);
  if (setup_.effects.energy) s.values.energy = static_cast<double>(store_.energy[pack].specific.value()[lane]);
  s.values.pressure = static_cast<double>(store_.volume[pack].kirchhoff_pressure[lane]);
  s.values.damage = setup_.effects.fully_damaged ? 1.0 : 0.0;
  if (store_.has(Group::kDamageLevel)) {
    s.values.damage = std::pow(static_cast<double>(store_.damage_level[pack].root[lane]), 3);
  }
  return s;
}

template <class P>
void HostEngine<P>::report_fault() {
  for_each_particle([&](std::size_t slot, BlockCoord block) {
    if (slot != fault_.slot) return;
    ParticleFault fault{sample(slot, block), {}, fault_.finite};
    fault.after = {{fault_.velocity[0], fault_.velocity[1], fault_.velocity[2]},
                   1.0 + fault_.volume_change,
                   fault_.energy,
                   fault_.kirchhoff_pressure,
                   setup_.effects.fully_damaged ? 1.0 : std::pow(fault_.damage_root, 3)};
    report_.fault = fault;
  });
}

template <class P>
std::optional<ParticleSample> HostEngine<P>::fastest() const {
  std::optional<ParticleSample> worst;
  double most = -1.0;
  const auto consider = [&](std::size_t slot, BlockCoord block, const TileBox& starts) {
    const std::size_t pack = slot / kLanes;
    const int lane = static_cast<int>(slot % kLanes);
    const std::int32_t node = store_.kinematics[pack].node[lane];
    double speed = 0.0;
    bool outside = false;
    for (int axis = 0; axis < 3; ++axis) {
      speed = std::max(speed, std::abs(static_cast<double>(store_.kinematics[pack].velocity[axis][lane])));
      const int start = ((node >> (8 * axis)) & 255) - kNodeBias + kTileMargin - 1;
      outside = outside || start < starts.low[axis] || start > starts.high[axis];
    }
    if (outside) speed = HUGE_VAL;
    if (!(speed > most)) return;
    most = speed;
    worst = sample(slot, block);
  };
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    for (std::uint32_t n = 0; n < tiles_[t].particles; ++n) {
      consider(tiles_[t].first_pack * kLanes + n, block_coord(stacks_[t]), tiles_[t].starts);
    }
  }
  for (std::uint32_t n = 0; n < lone_.particles; ++n) {
    consider(lone_.first_pack * kLanes + n, lone_stack_[n], kAnyStart);
  }
  return worst;
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

// What an engine's setup means for its particles and transfers: the same for the engines of all devices.
#pragma once

#include "grid/engine.hpp"
#include "grid/tile.hpp"

namespace breccia::grid {

/// The groups of fields that the effects need.
inline GroupSet groups_for(const EngineSetup& setup) {
  const material::RuntimeEffects& fx = setup.effects;
  return {.elastic = fx.shear,
          .energy = fx.energy,
          .damage_level = (fx.strength || fx.damage) && !fx.fully_damaged,
          .flaws = fx.damage,
          .gravity = setup.self_gravity};
}

inline TransferParameters transfer_for(const NumericsParameters& numerics) {
  switch (numerics.transfer) {
    case Transfer::kApic:
      return {.alpha = 0.0, .beta = 0.0, .affine = true};
    case Transfer::kFlip:
      return {.alpha = numerics.asflip_alpha, .beta = 0.0, .affine = false};
    case Transfer::kAsflip:
      break;
  }
  return {.alpha = numerics.asflip_alpha, .beta = numerics.asflip_beta, .affine = true};
}

}  // namespace breccia::grid

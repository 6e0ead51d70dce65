// Which effects a scene calls for, and why (design: the table of effects in docs/usage.md).
#pragma once

#include <string>
#include <vector>

#include "breccia/scene.hpp"
#include "material/effects_policy.hpp"

namespace breccia::sim {

/// One effect as decided, with the reason that `check` prints.
struct EffectDecision {
  std::string name;  ///< gravity, shear, strength, damage, viscosity, energy
  bool on = false;
  std::string reason;
};

struct ResolvedEffects {
  material::RuntimeEffects material;
  bool gravity = false;
  GravityMethod gravity_method = GravityMethod::kOff;
  std::vector<EffectDecision> decisions;
};

ResolvedEffects resolve_effects(const Scene& scene);

}  // namespace breccia::sim

#include "sim/effects.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "scene/orbit.hpp"

namespace breccia::sim {
namespace {

EffectDecision decide(const char* name, Switch wish, bool automatic, const std::string& reason) {
  switch (wish) {
    case Switch::kOn:
      return {name, true, "the scene says so"};
    case Switch::kOff:
      return {name, false, "the scene says so"};
    case Switch::kAuto:
      break;
  }
  return {name, automatic, reason};
}

EffectDecision decide_gravity(const Scene& scene) {
  if (scene.effects.gravity == GravityMethod::kOff) return {"gravity", false, "the scene says so"};
  if (scene.effects.gravity == GravityMethod::kDirect) return {"gravity", true, "direct summation, the scene says so"};
  if (scene.effects.gravity == GravityMethod::kTree) return {"gravity", true, "tree, the scene says so"};
  if (scene.effects.gravity == GravityMethod::kTreePm) {
    return {"gravity", true, "particle mesh and tree, the scene says so"};
  }
  const double compactness = scene::compactness(scene);
  const bool on = compactness >= scene::kNegligibleCompactness;
  return {"gravity", on,
          fmt::format("G M/(R c0^2) = {:.2g} is {} {:.0e}{}", compactness, on ? "at least" : "below",
                      scene::kNegligibleCompactness, on ? "; the cheapest method within gravity.error" : "")};
}

}  // namespace

ResolvedEffects resolve_effects(const Scene& scene) {
  const bool rigid = std::any_of(scene.materials.begin(), scene.materials.end(),
                                 [](const MaterialParameters& m) { return m.shear_modulus > 0.0; });
  const bool all_broken =
      std::all_of(scene.bodies.begin(), scene.bodies.end(), [](const BodyParameters& b) { return b.damage >= 1.0; });
  const EffectSwitches& wish = scene.effects;
  const EffectDecision gravity = decide_gravity(scene);
  const EffectDecision shear =
      decide("shear", wish.shear, rigid, rigid ? "a material has a shear modulus" : "every shear modulus is 0");
  EffectDecision strength = decide("strength", wish.strength, shear.on, shear.on ? "shear is on" : "shear is off");
  if (strength.on && !shear.on) strength = {"strength", false, "shear is off: no deviatoric stress to limit"};
  EffectDecision damage =
      decide("damage", wish.damage, strength.on && !all_broken,
             all_broken    ? "every body starts with D = 1"
             : strength.on ? "strength is on and some rock is intact; freed once every particle has D = 1"
                           : "strength is off");
  if (damage.on && all_broken) damage = {"damage", false, "every body starts with D = 1: nothing left to break"};
  const EffectDecision viscosity = decide("viscosity", wish.viscosity, true, "shocks need it");
  const EffectDecision energy = decide("energy", wish.energy, true, "it enters the equation of state");

  ResolvedEffects effects;
  effects.material = {.shear = shear.on,
                      .strength = strength.on,
                      .damage = damage.on,
                      .viscosity = viscosity.on,
                      .energy = energy.on,
                      .fully_damaged = all_broken && strength.on};
  effects.gravity = gravity.on;
  effects.gravity_method = gravity.on ? wish.gravity : GravityMethod::kOff;
  effects.decisions = {gravity, shear, strength, damage, viscosity, energy};
  return effects;
}

}  // namespace breccia::sim

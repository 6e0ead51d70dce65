// Keys of [effects], [gravity], [numerics], [parallel] and [output].
#include "scene/keys.hpp"

namespace breccia::scene {

namespace {

// Order of Switch.
const std::vector<std::string_view> kSwitch{"false", "true", "auto"};

std::vector<Key> effects() {
  return {
      {"effects.gravity",
       kPure,
       kAny,
       {"off", "direct", "tree", "treepm", "auto"},
       "",
       "",
       "self-gravity: sum over pairs, tree, or particle mesh; auto takes the cheapest, none if "
       "G M/(R c0^2) < 1e-9",
       [](Draft& d, std::size_t) { return choice(d.scene.effects.gravity); }},
      {"effects.shear", kPure, kAny, kSwitch, "", "", "shear stress; off leaves pressure only; auto: on unless mu = 0",
       [](Draft& d, std::size_t) { return choice(d.scene.effects.shear); }},
      {"effects.strength", kPure, kAny, kSwitch, "", "",
       "yield and friction; off is elastic without limit; auto: as shear",
       [](Draft& d, std::size_t) { return choice(d.scene.effects.strength); }},
      {"effects.damage", kPure, kAny, kSwitch, "", "",
       "flaws and crack growth; auto: on while a particle is below damage 1",
       [](Draft& d, std::size_t) { return choice(d.scene.effects.damage); }},
      {"effects.viscosity", kPure, kAny, kSwitch, "", "", "artificial viscosity; auto: on",
       [](Draft& d, std::size_t) { return choice(d.scene.effects.viscosity); }},
      {"effects.energy", kPure, kAny, kSwitch, "", "", "internal energy and its pressure; auto: on",
       [](Draft& d, std::size_t) { return choice(d.scene.effects.energy); }},
  };
}

std::vector<Key> gravity() {
  return {
      {"gravity.interval",
       kPure,
       {1.0, 4096.0},
       {},
       "",
       "",
       "steps between two evaluations of self-gravity",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.gravity.interval; }},
      {"gravity.softening",
       kLength,
       kNonNegative,
       {},
       "",
       "0.05 grid.cell",
       "Plummer softening length",
       [](Draft& d, std::size_t) -> Slot { return &d.softening; }},
      {"gravity.error",
       kPure,
       kPositive,
       {},
       "",
       "",
       "error of the acceleration that is good enough: rms over the particles, relative; auto allows the net force on "
       "a "
       "dense body 3.7 times that",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.gravity.error; }},
      {"gravity.opening",
       kPure,
       kNonNegative,
       {},
       "",
       "0: follows from gravity.error",
       "tree: error allowed to one cell, relative to the acceleration",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.gravity.opening; }},
      {"gravity.mesh",
       kLength,
       kNonNegative,
       {},
       "",
       "0: 1.3 mean distances of the particles",
       "treepm: cell of the mesh",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.gravity.mesh; }},
      {"gravity.split",
       kPure,
       kNonNegative,
       {},
       "",
       "0: follows from gravity.error",
       "treepm: scale below which pairs are summed instead, in mesh cells; at least 0.6",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.gravity.split; }},
      {"gravity.uniform",
       kAcceleration,
       kAny,
       {},
       "",
       "",
       "constant field added to self-gravity",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.gravity.uniform; }},
  };
}

std::vector<Key> numerics() {
  return {
      {"numerics.precision",
       kPure,
       kAny,
       {"mixed", "double"},
       "",
       "",
       "arithmetic of the engine",
       [](Draft& d, std::size_t) { return choice(d.scene.numerics.precision); }},
      {"numerics.transfer",
       kPure,
       kAny,
       {"asflip", "apic", "flip"},
       "",
       "",
       "grid to particle transfer",
       [](Draft& d, std::size_t) { return choice(d.scene.numerics.transfer); }},
      {"numerics.asflip_alpha",
       kPure,
       kFraction,
       {},
       "",
       "",
       "ASFLIP: share of the particle's own velocity kept",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.numerics.asflip_alpha; }},
      {"numerics.asflip_beta",
       kPure,
       kFraction,
       {},
       "",
       "",
       "ASFLIP: share of that correction that also moves the particle",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.numerics.asflip_beta; }},
      {"numerics.sort_interval",
       kPure,
       {1.0, 4096.0},
       {},
       "",
       "",
       "most steps between two sortings of the particles",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.numerics.sort_interval; }},
      {"numerics.energy_gain",
       kPure,
       {0.0, 1.0e9, true, false},
       {},
       "",
       "",
       "a run whose energy rises by more than this share of max(kinetic + |potential|) is stopped: it is unstable",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.numerics.energy_gain; }},
      {"numerics.lone_without_grid",
       kPure,
       kAny,
       {},
       "",
       "",
       "closed form for particles that share no node with another one; the same result to rounding, much faster",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.numerics.lone_without_grid; }},
      {"numerics.overlap",
       kPure,
       kAny,
       {},
       "",
       "",
       "messages between ranks travel while the inside of each slab is computed; false waits for them, the same result",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.numerics.overlap; }},
      {"numerics.reproducible",
       kPure,
       kAny,
       {},
       "",
       "",
       "the same bits on any number of ranks (with self-gravity: on the same number of ranks)",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.numerics.reproducible; }},
      {"numerics.cap_damaged_yield",
       kPure,
       kAny,
       {},
       "",
       "",
       "strength of damaged rock never above that of intact rock; false is literal",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.numerics.literal.cap_damaged_yield; }},
      {"numerics.linear_tension",
       kPure,
       kAny,
       {},
       "",
       "",
       "Lundborg strength linear in tension, without its pole; false is literal",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.numerics.literal.linear_tension; }},
      {"numerics.viscosity_in_yield",
       kPure,
       kAny,
       {},
       "",
       "",
       "artificial viscosity counts in the pressure of the strength (literal)",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.numerics.literal.viscosity_in_yield; }},
      {"numerics.volume_ratio_max",
       kPure,
       {1.0, 1.0e6, true, false},
       {},
       "",
       "",
       "volume ratio J of a lone expanding particle stops here",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.numerics.literal.volume_ratio_max; }},
  };
}

std::vector<Key> parallel() {
  return {
      {"parallel.balance",
       kPure,
       kAny,
       {"off", "always", "auto"},
       "",
       "",
       "when slabs are cut anew, at the start of a gravity window: never, at each, or (auto) where the counted work of "
       "the ranks has become uneven and other cuts help",
       [](Draft& d, std::size_t) { return choice(d.scene.parallel.balance); }},
      {"parallel.imbalance",
       kPure,
       {1.0, 1.0e6},
       {},
       "",
       "",
       "largest over mean work of the ranks that auto lets be",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.parallel.imbalance; }},
      {"parallel.axis",
       kPure,
       kAny,
       {"x", "y", "z", "auto"},
       "",
       "",
       "axis that slabs cut across; auto: the longest of the matter where particles are first shared out. A restart "
       "may "
       "change it",
       [](Draft& d, std::size_t) -> Slot {
         std::optional<int>& axis = d.scene.parallel.axis;
         return ChoiceSlot{
             [&axis] { return std::optional(static_cast<std::size_t>(axis.value_or(3))); },
             [&axis](std::size_t i) { axis = i < 3 ? std::optional(static_cast<int>(i)) : std::nullopt; }};
       }},
      {"parallel.device_messages",
       kPure,
       kAny,
       {"mpi", "nccl", "auto"},
       "",
       "",
       "what carries sums between the CUDA devices of several ranks in every step: MPI; NCCL, which needs libnccl.so.2 "
       "and a device for each rank, and has not run on hardware here (docs/gpu.md); or (auto) NCCL where both are "
       "there. The host engine does not look at it",
       [](Draft& d, std::size_t) { return choice(d.scene.parallel.device_messages); }},
  };
}

std::vector<Key> output() {
  return {
      {"output.snapshots",
       kTime,
       kPositive,
       {},
       "start and end",
       "",
       "snapshots in between: \"every 1000 s\"; the first and last state are always written",
       [](Draft& d, std::size_t) -> Slot {
         double& interval = d.scene.output.snapshot_interval;
         const auto seconds = interval > 0.0 ? std::optional(interval) : std::nullopt;
         return IntervalSlot{seconds, [&interval](double s) { interval = s; }};
       }},
      {"output.diagnostics",
       kTime,
       kPositive,
       {},
       "",
       "every scene.end/200",
       "rows of diagnostics.csv: \"every 100 s\"",
       [](Draft& d, std::size_t) -> Slot {
         return IntervalSlot{d.diagnostics, [&d](double s) { d.diagnostics = s; }};
       }},
      {"output.fields",
       kPure,
       kAny,
       {},
       "",
       "all there are",
       "fields of the snapshots by their name in the file",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.output.fields; }},
      {"output.checkpoint_wall",
       kTime,
       kNonNegative,
       {},
       "off",
       "",
       "wall time between checkpoints, or \"off\"; written at the start of the next gravity window",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.output.checkpoint_wall; }},
      {"output.checkpoint_time",
       kTime,
       kPositive,
       {},
       "off",
       "",
       "checkpoints by simulated time besides: \"every 500 s\"",
       [](Draft& d, std::size_t) -> Slot {
         double& interval = d.scene.output.checkpoint_time;
         const auto seconds = interval > 0.0 ? std::optional(interval) : std::nullopt;
         return IntervalSlot{seconds, [&interval](double s) { interval = s; }};
       }},
      {"output.keep",
       kPure,
       {1.0, 1.0e6},
       {},
       "",
       "",
       "the newest checkpoints that stay; older ones are removed",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.output.keep; }},
      {"output.analysis",
       kTime,
       kNonNegative,
       {},
       "",
       "none",
       "times of an analysis of the fragments, besides the end",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.output.analysis_times; }},
      {"output.link",
       kPure,
       kPositive,
       {},
       "",
       "",
       "friends-of-friends linking length of the analysis, in cells",
       [](Draft& d, std::size_t) -> Slot { return &d.scene.output.link_cells; }},
  };
}

}  // namespace

std::vector<Key> method_keys() {
  std::vector<Key> keys = effects();
  for (auto part : {gravity(), numerics(), parallel(), output()})
    for (Key& key : part) keys.push_back(std::move(key));
  return keys;
}

std::span<const Key> key_table() {
  static const std::vector<Key> table = [] {
    std::vector<Key> keys = run_keys();
    for (auto part : {material_keys(), body_keys(), method_keys()})
      for (Key& key : part) keys.push_back(std::move(key));
    return keys;
  }();
  return table;
}

}  // namespace breccia::scene

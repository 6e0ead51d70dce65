// The whole state of an engine at a state boundary, in a form that does not depend on engine, device or number of
// ranks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace breccia {

/// One field of this rank's particles, bit for bit as the engine holds it.
struct StateColumn {
  std::string name;
  std::string unit;
  std::string meaning;
  std::size_t element_bytes = 0;  ///< 4 or 8
  std::size_t components = 1;
  std::vector<std::byte> values;  ///< particle after particle, its components together
};

/// Particles stand in storage order: a continued run adds in the same order as one that was not interrupted. Thresholds
/// of flaws are not here: they follow from the scene and the ids.
struct EngineState {
  std::uint64_t particles = 0;          ///< of this rank
  std::vector<std::int32_t> node;       ///< nearest grid node, 3 per particle, global
  std::vector<StateColumn> columns;     ///< all fields that the run's effects need
  bool damage_finished = false;         ///< every particle has D = 1: the fields of damage are gone
  double smallest_mass = 0.0;           ///< of all particles at the start [kg]
  int slab_axis = 0;                    ///< axis the grid is cut along
  std::vector<std::int32_t> slab_cuts;  ///< first plane of nodes of each rank but rank 0
  bool same_ranks = true;               ///< taken on as many ranks by this program: slabs are to be kept
};

}  // namespace breccia

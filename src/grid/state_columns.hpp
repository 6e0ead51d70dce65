// Fields of particles as columns of a saved state: the same for the engines of all devices.
#pragma once

#include <cstring>
#include <string>
#include <vector>

#include "breccia/engine_state.hpp"
#include "breccia/linalg.hpp"
#include "breccia/scene.hpp"
#include "grid/particles.hpp"

namespace breccia::grid {

/// Nodes are saved as global ones, of the flaws only how many grow: the rest follows from their thresholds.
bool saved_as_it_is(const FieldDescriptor& field);

inline constexpr const char* kActiveFlaws = "flaws_active";

/// An empty column for this many particles.
StateColumn column_for(const FieldDescriptor& field, std::size_t particles);

/// Throws IoError if there is no such column or it has another size.
const StateColumn& find_column(const EngineState& state, const std::string& name, std::size_t element_bytes,
                               std::size_t components);

/// The values of a column of T, all components of a particle side by side. Throws as find_column().
template <class T>
std::vector<T> column_values(const EngineState& state, const std::string& name, std::size_t components) {
  const StateColumn& column = find_column(state, name, sizeof(T), components);
  std::vector<T> values(state.particles * components);
  if (!values.empty()) std::memcpy(values.data(), column.values.data(), column.values.size());
  return values;
}

/// The accelerations that the particles hold, saved by an engine of this precision [m/s2]. Throws as find_column().
std::vector<Vec3d> held_accelerations(const EngineState& state, Precision precision);

}  // namespace breccia::grid

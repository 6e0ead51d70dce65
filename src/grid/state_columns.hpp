// Fields of particles as columns of a saved state: the same for the engines of all devices.
#pragma once

#include <string>

#include "breccia/engine_state.hpp"
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

}  // namespace breccia::grid

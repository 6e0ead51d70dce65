#include "grid/state_columns.hpp"

#include <algorithm>

#include "breccia/error.hpp"

namespace breccia::grid {

bool saved_as_it_is(const FieldDescriptor& field) {
  const std::string name = field.name;
  if (field.group == Group::kFlaws) return name == "total_strain";
  return name != "node";
}

StateColumn column_for(const FieldDescriptor& field, std::size_t particles) {
  StateColumn column{field.name,
                     field.unit,
                     field.meaning,
                     static_cast<std::size_t>(field.element_bytes),
                     static_cast<std::size_t>(field.components),
                     {}};
  column.values.resize(particles * column.element_bytes * column.components);
  return column;
}

const StateColumn& find_column(const EngineState& state, const std::string& name, std::size_t element_bytes,
                               std::size_t components) {
  const auto found = std::find_if(state.columns.begin(), state.columns.end(),
                                  [&](const StateColumn& column) { return column.name == name; });
  if (found == state.columns.end()) throw IoError("the checkpoint has no field " + name);
  if (found->element_bytes != element_bytes || found->components != components ||
      found->values.size() != state.particles * element_bytes * components) {
    throw IoError("the checkpoint's field " + name + " has another size than this run needs");
  }
  return *found;
}

std::vector<Vec3d> held_accelerations(const EngineState& state, Precision precision) {
  std::vector<Vec3d> a(state.particles);
  const auto read = [&](auto zero) {
    const auto values = column_values<decltype(zero)>(state, "gravity", 3);
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] = {static_cast<double>(values[3 * i]), static_cast<double>(values[3 * i + 1]),
              static_cast<double>(values[3 * i + 2])};
    }
  };
  precision == Precision::kDouble ? read(0.0) : read(0.0F);
  return a;
}

}  // namespace breccia::grid

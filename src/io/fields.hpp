// The fields of a snapshot, declared once: what is written, how it is described, and the table of the documentation.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "breccia/particle_arrays.hpp"

namespace breccia::io {

/// Where the values of a field are: one of the vectors of ParticleOutput.
using FieldData =
    std::variant<std::vector<double> ParticleOutput::*, std::vector<Vec3d> ParticleOutput::*,
                 std::vector<std::uint64_t> ParticleOutput::*, std::vector<std::uint32_t> ParticleOutput::*>;

/// One field of a snapshot.
struct Field {
  const char* name;
  const char* unit;     ///< "1": a number without unit
  const char* meaning;  ///< ends up in the attribute Description
  const char* effect;   ///< the effect without which the field is not there; "" if it always is
  bool required;        ///< written whether asked for or not: what the analysis cannot do without
  FieldData data;
};

/// All fields a snapshot can hold, in the order of the file.
std::span<const Field> snapshot_fields();

/// Throws UsageError naming the nearest field if one of `names` is not a field.
void require_known_fields(std::span<const std::string> names);

/// Values per particle: 1 or 3.
int components(const Field& field);
/// "float64", "uint64", "uint32".
std::string type_name(const Field& field);

/// The table of the documentation, Markdown.
std::string fields_table();

}  // namespace breccia::io

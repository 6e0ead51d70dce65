#include "io/fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "breccia/error.hpp"

namespace breccia::io {

namespace {

using Out = ParticleOutput;

const std::array kFields{
    Field{"Coordinates", "m", "position", "", true, &Out::position},
    Field{"Velocities", "m/s", "velocity", "", true, &Out::velocity},
    Field{"Masses", "kg", "mass", "", true, &Out::mass},
    Field{"ParticleIDs", "1", "global number of the particle, 0 to N-1, bodies one after the other", "", true,
          &Out::id},
    Field{"BodyIDs", "1", "number of the body in the scene, from 0", "", false, &Out::body},
    Field{"MaterialIDs", "1", "number of the material in the scene, from 0", "", false, &Out::material},
    Field{"Damage", "1", "damage D: 0 intact, 1 fully damaged", "", false, &Out::damage},
    Field{"Density", "kg/m3", "density rho0 / J of the material", "", false, &Out::density},
    Field{"GridDensity", "kg/m3", "mass density of the grid at the particle", "", false, &Out::grid_density},
    Field{"InternalEnergy", "J/kg", "specific internal energy", "energy", false, &Out::internal_energy},
    Field{"Pressure", "Pa", "pressure, artificial viscosity included", "", false, &Out::pressure},
    Field{"ShearStress", "Pa", "sqrt(J2) of the Cauchy stress", "shear", false, &Out::shear_stress},
};

// Edits (insert, delete, replace) that turn one word into the other.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replace, row[j - 1] + 1, row[j] + 1});
    }
  }
  return row.back();
}

template <class T>
struct ElementOf;
template <class T>
struct ElementOf<std::vector<T> ParticleOutput::*> {
  using type = T;
};

}  // namespace

std::span<const Field> snapshot_fields() { return kFields; }

void require_known_fields(std::span<const std::string> names) {
  for (const std::string& name : names) {
    const auto distance = [&](const Field& field) { return edit_distance(name, field.name); };
    const auto nearest = std::ranges::min_element(kFields, {}, distance);
    if (nearest->name == name) continue;
    throw UsageError(fmt::format("output.fields: no field '{}'; did you mean '{}'?", name, nearest->name));
  }
}

int components(const Field& field) {
  return std::holds_alternative<std::vector<Vec3d> ParticleOutput::*>(field.data) ? 3 : 1;
}

std::string type_name(const Field& field) {
  return std::visit(
      [](auto member) -> std::string {
        using Element = typename ElementOf<decltype(member)>::type;
        if constexpr (std::is_same_v<Element, std::uint64_t>) return "uint64";
        if constexpr (std::is_same_v<Element, std::uint32_t>) return "uint32";
        return "float64";
      },
      field.data);
}

std::string fields_table() {
  std::string table = "| Field | Unit | Type | Meaning | Needs effect |\n|---|---|---|---|---|\n";
  for (const Field& field : kFields) {
    const std::string shape = components(field) == 3 ? " x 3" : "";
    table +=
        fmt::format("| `{}`{} | {} | {}{} | {} | {} |\n", field.name, field.required ? " (always)" : "", field.unit,
                    type_name(field), shape, field.meaning, *field.effect != '\0' ? field.effect : "-");
  }
  return table;
}

}  // namespace breccia::io

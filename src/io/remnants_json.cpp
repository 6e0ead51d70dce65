#include "io/remnants_json.hpp"

#include <cmath>

namespace breccia::io {

namespace {

using Json = nlohmann::json;

Json or_null(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json vector_json(Vec3d v) { return {v.x, v.y, v.z}; }

Json remnant_json(const analysis::Remnant& remnant) {
  return {
      {"mass", remnant.mass},
      {"mass_over_target", remnant.mass_over_target},
      {"particles", remnant.particles},
      {"a", remnant.a},
      {"b", remnant.b},
      {"c", remnant.c},
      {"b_over_a", remnant.b_over_a},
      {"c_over_a", remnant.c_over_a},
      {"class", analysis::class_name(remnant.shape)},
      {"class_195", analysis::class_name(remnant.shape_195)},
      {"class_190", analysis::class_name(remnant.shape_190)},
      {"spin_period", or_null(remnant.spin_period)},
      {"bound_mass", or_null(remnant.bound_mass)},
      {"position", vector_json(remnant.position)},
      {"velocity", vector_json(remnant.velocity)},
      {"spin", vector_json(remnant.spin)},
      {"angular_momentum", vector_json(remnant.angular_momentum)},
      {"axes", {vector_json(remnant.axes[0]), vector_json(remnant.axes[1]), vector_json(remnant.axes[2])}},
      {"trimmed_extent", remnant.trimmed_extent},
  };
}

}  // namespace

nlohmann::json remnants_json(std::span<const analysis::Remnant> remnants) {
  Json list = Json::array();
  for (const analysis::Remnant& remnant : remnants) list.push_back(remnant_json(remnant));
  return list;
}

}  // namespace breccia::io

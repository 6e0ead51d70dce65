#include "cli/check_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "cli/human_units.hpp"
#include "scene/units.hpp"

namespace breccia::cli {

double CheckReport::steps() const { return std::ceil(loaded.scene.time.end / plan.time_step); }

double CheckReport::wall_seconds() const { return calibration.seconds_per_step * steps() / ranks; }

namespace {

using Text = fmt::memory_buffer;

void append_keys(Text& text, const std::vector<ResolvedKey>& keys) {
  std::size_t width = 0;
  for (const ResolvedKey& key : keys) width = std::max(width, key.key.size());
  fmt::format_to(std::back_inserter(text), "Parameters (* as given, the others by default)\n");
  for (const ResolvedKey& key : keys) {
    fmt::format_to(std::back_inserter(text), "  {} {:{}}  {}\n", key.given ? '*' : ' ', key.key, width, key.value);
  }
}

void append_effects(Text& text, const std::vector<sim::EffectDecision>& effects) {
  fmt::format_to(std::back_inserter(text), "\nEffects\n");
  for (const sim::EffectDecision& effect : effects) {
    fmt::format_to(std::back_inserter(text), "  {:10} {:4} {}\n", effect.name, effect.on ? "on" : "off", effect.reason);
  }
}

std::string format_vector(Vec3d v, const char* unit) {
  // Adding zero prints -0 as 0.
  return fmt::format("({:.6g}, {:.6g}, {:.6g}) {}", v.x + 0.0, v.y + 0.0, v.z + 0.0, unit);
}

void append_bodies(Text& text, const std::vector<BodyParameters>& bodies) {
  fmt::format_to(std::back_inserter(text), "\nBodies\n");
  for (const BodyParameters& body : bodies) {
    fmt::format_to(std::back_inserter(text), "  {}: {} particles, {:.6g} kg\n", body.name, body.particles, body.mass);
    fmt::format_to(std::back_inserter(text), "    at {}, moving with {}, spinning with {}\n",
                   format_vector(body.position, "m"), format_vector(body.velocity, "m/s"),
                   format_vector(body.spin, "rad/s"));
  }
}

void append_plan(Text& text, const CheckReport& report) {
  const sim::Plan& plan = report.plan;
  fmt::format_to(std::back_inserter(text), "\nPlan\n");
  fmt::format_to(std::back_inserter(text), "  time step        {:.6g} s, {}\n", plan.time_step,
                 plan.time_step_limited_by);
  fmt::format_to(std::back_inserter(text), "  steps            {:.0f}, to {}\n", report.steps(),
                 scene::format_quantity(report.loaded.scene.time.end, scene::kTime));
  fmt::format_to(std::back_inserter(text), "  particles        {}\n", plan.particles);
  fmt::format_to(
      std::back_inserter(text), "  memory per rank  {} on {} rank{}, of it {:.0f} bytes of fields per particle\n",
      human_bytes(report.calibration.host_bytes), report.ranks, report.ranks == 1 ? "" : "s", plan.bytes_per_particle);
  if (report.calibration.device_bytes > 0.0) {
    fmt::format_to(std::back_inserter(text), "  on CUDA devices  {} of a device for each rank\n",
                   human_bytes(report.calibration.device_bytes));
  }
  fmt::format_to(std::back_inserter(text), "  wall time        about {}: {} per step on one core of this machine\n",
                 human_duration(report.wall_seconds()), human_duration(report.calibration.seconds_per_step));
}

}  // namespace

std::string as_text(const CheckReport& report) {
  Text text;
  fmt::format_to(std::back_inserter(text), "Scene {} ({})\n\n", report.loaded.scene.name, report.loaded.scene.file);
  append_keys(text, report.loaded.keys);
  append_effects(text, report.plan.effects);
  append_bodies(text, report.loaded.scene.bodies);
  append_plan(text, report);
  return fmt::to_string(text);
}

Json as_json(const CheckReport& report) {
  Json json;
  json["scene"] = report.loaded.scene.name;
  json["parameters"] = Json::array();
  for (const ResolvedKey& key : report.loaded.keys) {
    json["parameters"].push_back({{"key", key.key}, {"value", key.value}, {"given", key.given}});
  }
  json["bodies"] = Json::array();
  for (const BodyParameters& body : report.loaded.scene.bodies) {
    json["bodies"].push_back({{"name", body.name},
                              {"mass", body.mass},
                              {"particles", body.particles},
                              {"position", to_json(body.position)},
                              {"velocity", to_json(body.velocity)},
                              {"spin", to_json(body.spin)}});
  }
  for (const sim::EffectDecision& effect : report.plan.effects) {
    json["effects"][effect.name] = {{"on", effect.on}, {"reason", effect.reason}};
  }
  json["gravity_method"] = report.plan.gravity_method;
  json["time_step"] = report.plan.time_step;
  json["time_step_limited_by"] = report.plan.time_step_limited_by;
  json["steps"] = report.steps();
  json["particles"] = report.plan.particles;
  json["bytes_per_particle"] = report.plan.bytes_per_particle;
  json["ranks"] = report.ranks;
  json["memory_per_rank"] = report.calibration.host_bytes;
  if (report.calibration.device_bytes > 0.0) json["device_memory_per_rank"] = report.calibration.device_bytes;
  json["seconds_per_step"] = report.calibration.seconds_per_step;
  json["wall_seconds"] = report.wall_seconds();
  return json;
}

}  // namespace breccia::cli

#include "io/summary.hpp"

#include <algorithm>

#include "io/collectively.hpp"
#include "io/durable_file.hpp"
#include "io/machine.hpp"

namespace breccia::io {

namespace {

using Json = nlohmann::ordered_json;

double particle_steps_per_second(const RunSummary& summary) {
  if (summary.wall_seconds <= 0.0) return 0.0;
  return static_cast<double>(summary.particles) * static_cast<double>(summary.steps) / summary.wall_seconds;
}

Json conservation_json(const Conservation& drift) {
  return {{"mass", drift.mass},
          {"momentum", drift.momentum},
          {"angular_momentum", drift.angular_momentum},
          {"energy", drift.energy}};
}

Json stages_json(const std::vector<StageTiming>& stages) {
  Json list = Json::array();
  for (const StageTiming& stage : stages) {
    list.push_back({{"stage", stage.name}, {"seconds", stage.seconds}, {"calls", stage.calls}});
  }
  return list;
}

Json halo_json(const std::optional<HaloTiming>& halo) {
  if (!halo) return nullptr;
  return {{"in_flight_seconds", halo->in_flight_seconds},
          {"waited_seconds", halo->waited_seconds},
          {"hidden_fraction", halo->hidden_fraction},
          {"bytes_per_step", halo->bytes_per_step},
          {"key_exchanges", halo->key_exchanges}};
}

Json scene_json(const std::vector<ResolvedKey>& keys) {
  Json scene = Json::object();
  for (const ResolvedKey& key : keys) scene[key.key] = key.value;
  return scene;
}

// Keys the user gave that the run used, and keys without effect.
Json used_keys(const RunSummary& summary) {
  Json used = Json::array();
  for (const ResolvedKey& key : summary.scene) {
    const bool unused = std::ranges::find(summary.unused_keys, key.key) != summary.unused_keys.end();
    if (key.given && !unused) used.push_back(key.key);
  }
  return used;
}

Json versions_json() {
  Json versions = Json::object();
  for (const auto& [name, version] : library_versions()) versions[name] = version;
  return versions;
}

Json machine_json() {
  const Machine machine = this_machine();
  return {{"cpu_model", machine.cpu_model}, {"instruction_set", machine.instruction_set}, {"cores", machine.cores}};
}

}  // namespace

nlohmann::ordered_json to_json(const RunSummary& summary) {
  Json json;
  json["particles"] = summary.particles;
  json["steps"] = summary.steps;
  json["simulated_time"] = summary.simulated_time;
  json["time_step"] = summary.time_step;
  json["wall_seconds"] = summary.wall_seconds;
  json["ranks"] = summary.ranks;
  json["threads"] = summary.threads;
  json["device"] = summary.device;
  json["precision"] = summary.precision;
  json["particle_steps_per_second"] = particle_steps_per_second(summary);
  json["conservation"] = conservation_json(summary.conservation);
  json["damaged_fraction"] = summary.damaged_fraction;
  json["clamped_volumes"] = summary.clamped_volumes;
  json["remnants"] = summary.remnants;
  json["stages"] = stages_json(summary.stages);
  json["halo"] = halo_json(summary.halo);
  json["gravity"] = summary.gravity;
  json["slabs"] = summary.slabs;
  json["versions"] = versions_json();
  json["machine"] = machine_json();
  json["scene"] = scene_json(summary.scene);
  json["used"] = used_keys(summary);
  json["unused"] = summary.unused_keys;
  return json;
}

void write_summary(const std::filesystem::path& path, const RunSummary& summary, const mpi::Comm& comm) {
  on_root(comm, [&] { write_file(path, to_json(summary).dump(2) + "\n"); });
}

void remove_summary(const std::filesystem::path& path, const mpi::Comm& comm) {
  on_root(comm, [&] { std::filesystem::remove(path); });
}

}  // namespace breccia::io

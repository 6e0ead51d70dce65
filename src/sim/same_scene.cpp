#include "sim/same_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "breccia/error.hpp"

namespace breccia::sim {
namespace {

// Keys that neither the particles nor their fields depend on. Those that end in '.' stand for all below.
constexpr std::array<std::string_view, 12> kHarmless{
    "output.",         "parallel.",        "numerics.energy_gain", "scene.name",   "scene.end",     "time.cfl",
    "effects.gravity", "gravity.interval", "gravity.opening",      "gravity.mesh", "gravity.split", "gravity.error"};

bool harmless(const std::string& key) {
  return std::ranges::any_of(kHarmless,
                             [&](std::string_view k) { return k.ends_with('.') ? key.starts_with(k) : key == k; });
}

// Gravity as a whole cannot come or go: its method may change.
std::string comparable(const std::string& key, const std::string& value) {
  if (key == "effects.gravity") return value == "off" ? "off" : "on";
  return harmless(key) ? "" : value;
}

}  // namespace

void require_same_scene(const std::vector<ResolvedKey>& before, const std::vector<ResolvedKey>& scene,
                        const std::string& file) {
  std::map<std::string, std::pair<std::string, std::string>> values;
  for (const ResolvedKey& key : before) values[key.key].first = comparable(key.key, key.value);
  for (const ResolvedKey& key : scene) values[key.key].second = comparable(key.key, key.value);
  std::string changed;
  for (const auto& [key, pair] : values) {
    if (pair.first == pair.second) continue;
    const auto shown = [](const std::string& value) { return value.empty() ? std::string("not set") : value; };
    changed += fmt::format("{}{} ({} there, {} here)", changed.empty() ? "" : ", ", key, shown(pair.first),
                           shown(pair.second));
  }
  if (changed.empty()) return;
  throw UsageError(
      fmt::format("{} is of another scene: {}; take these keys as they were, or start anew without "
                  "--restart in another folder",
                  file, changed));
}

std::string lasting_keys(const std::vector<ResolvedKey>& scene) {
  nlohmann::ordered_json keys = nlohmann::ordered_json::object();
  for (const ResolvedKey& key : scene) {
    const std::string value = comparable(key.key, key.value);
    if (!value.empty()) keys[key.key] = value;
  }
  return keys.empty() ? std::string() : keys.dump(1);
}

std::vector<ResolvedKey> keys_from(const std::string& json) {
  std::vector<ResolvedKey> keys;
  const nlohmann::ordered_json object = nlohmann::ordered_json::parse(json, nullptr, false);
  if (!object.is_object()) return keys;
  for (const auto& [key, value] : object.items()) {
    if (value.is_string()) keys.push_back({key, value.get<std::string>()});
  }
  return keys;
}

}  // namespace breccia::sim

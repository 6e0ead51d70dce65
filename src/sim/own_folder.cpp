#include "sim/own_folder.hpp"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "breccia/error.hpp"
#include "io/collectively.hpp"
#include "io/snapshot.hpp"
#include "io/snapshot_series.hpp"
#include "sim/run_state.hpp"

namespace breccia::sim {
namespace {

namespace fs = std::filesystem;

// The resolved keys of the run that ended here; none if none did.
std::vector<ResolvedKey> finished_keys(const fs::path& folder) {
  std::ifstream file(folder / "summary.json");
  const nlohmann::json summary = nlohmann::json::parse(file, nullptr, false);
  std::vector<ResolvedKey> keys;
  if (!summary.is_object() || !summary.contains("scene")) return keys;
  for (const auto& [key, value] : summary["scene"].items()) {
    if (value.is_string()) keys.push_back({key, value.get<std::string>()});
  }
  return keys;
}

std::string name_in(const std::vector<ResolvedKey>& keys) {
  for (const ResolvedKey& key : keys) {
    if (key.key == "scene.name") return key.value;
  }
  return {};
}

}  // namespace

void require_own_folder(const fs::path& folder, const Scene& scene, const std::vector<ResolvedKey>& keys,
                        const mpi::Comm& comm) {
  io::on_root(comm, [&] {
    const std::vector<ResolvedKey> finished = finished_keys(folder);
    std::string name = name_in(finished);
    const fs::path snapshot = folder / io::snapshot_name(0);
    if (name.empty() && fs::exists(snapshot)) name = io::scene_name_in(snapshot);
    if (!name.empty() && name != scene.name) {
      throw IoError(
          fmt::format("output folder {} holds results of the scene \"{}\", this one is \"{}\": name another "
                      "folder with --out",
                      folder.string(), name, scene.name));
    }
    if (!finished.empty() && !keys.empty()) require_same_scene(finished, keys, (folder / "summary.json").string());
  });
}

}  // namespace breccia::sim

#include "sim/old_results.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "breccia/error.hpp"
#include "io/checkpoint.hpp"
#include "io/collectively.hpp"
#include "io/snapshot.hpp"
#include "io/snapshot_series.hpp"
#include "sim/same_scene.hpp"

namespace breccia::sim {
namespace {

namespace fs = std::filesystem;

// What a file says of the scene it is of.
struct Record {
  fs::path file;
  std::string name;  // empty: unknown
  std::vector<ResolvedKey> keys;
};

void warn(const std::string& line) { fmt::print(stderr, "breccia: warning: {}\n", line); }

std::string value_of(const char* name, const std::vector<ResolvedKey>& keys) {
  for (const ResolvedKey& key : keys) {
    if (key.key == name) return key.value;
  }
  return {};
}

// Of the run that ended here; none if none did.
std::optional<Record> record_of_summary(const fs::path& path, OldResults& old) {
  std::ifstream file(path);
  if (!file) return std::nullopt;
  try {
    const nlohmann::json summary = nlohmann::json::parse(file);
    old.reached = summary.at("simulated_time").get<double>() + 0.5 * summary.at("time_step").get<double>();
    old.steps = summary.at("steps").get_ref<const nlohmann::json::number_unsigned_t&>();
    const std::vector<ResolvedKey> keys = keys_from(summary.at("scene").dump());
    if (const std::string window = value_of("gravity.interval", keys); !window.empty())
      old.window = std::stoull(window);
    old.ended = true;
    return Record{path, value_of("scene.name", keys), keys};
  } catch (const std::exception&) {  // of the library for JSON, of a folder of that name, of a number that is none
    warn(fmt::format("{}: not the summary of a run; it is passed over", path.string()));
  }
  return std::nullopt;
}

std::optional<Record> record_of_snapshot(const fs::path& path) {
  if (!fs::exists(path)) return std::nullopt;
  try {
    const io::SnapshotHeader header = io::read_snapshot_header(path);
    return Record{path, header.scene_name, keys_from(header.scene_keys)};
  } catch (const IoError& error) {
    const mpi::Comm self(MPI_COMM_SELF);
    if (io::checkpoint_numbers(path.parent_path(), self).empty()) throw;
    warn(fmt::format("{}; it is passed over", error.what()));
  }
  return std::nullopt;
}

void require_same(const Record& record, const fs::path& folder, const Scene& scene,
                  const std::vector<ResolvedKey>& keys) {
  if (!record.name.empty() && record.name != scene.name) {
    throw IoError(
        fmt::format("output folder {} holds results of the scene \"{}\", this one is \"{}\": name another "
                    "folder with --out",
                    folder.string(), record.name, scene.name));
  }
  if (!record.keys.empty() && !keys.empty()) require_same_scene(record.keys, keys, record.file.string());
}

bool has_snapshots(const fs::path& folder) {
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("snap_") && name.ends_with(".hdf")) return true;
  }
  return false;
}

}  // namespace

OldResults old_results(const fs::path& folder, const Scene& scene, const std::vector<ResolvedKey>& keys,
                       const mpi::Comm& comm) {
  OldResults old;
  io::on_root(comm, [&] {
    old.any = fs::exists(folder / "diagnostics.csv");
    old.headless = has_snapshots(folder) && !fs::exists(folder / io::snapshot_name(0));
    std::optional<Record> record = record_of_summary(folder / "summary.json", old);
    if (!record) record = record_of_snapshot(folder / io::snapshot_name(0));
    if (record) require_same(*record, folder, scene, keys);
  });
  return comm.allgather(old).front();
}

}  // namespace breccia::sim

#include "io/snapshot_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "breccia/error.hpp"
#include "io/collectively.hpp"
#include "io/durable_file.hpp"

namespace breccia::io {

namespace {

struct Entry {
  std::string name;
  double time = 0.0;
};

std::vector<Entry> read_entries(const std::filesystem::path& path) {
  std::vector<Entry> entries;
  if (!std::filesystem::exists(path)) return entries;
  try {
    std::ifstream stream(path);
    const nlohmann::json series = nlohmann::json::parse(stream);
    for (const auto& file : series.at("files")) {
      entries.push_back({file.at("name").get<std::string>(), file.at("time").get<double>()});
    }
  } catch (const nlohmann::json::exception& error) {
    throw IoError(
        fmt::format("{}: not a list of snapshots ({}); remove it to start a new one", path.string(), error.what()));
  }
  return entries;
}

void write_entries(const std::filesystem::path& path, std::vector<Entry> entries) {
  std::ranges::stable_sort(entries, {}, &Entry::time);
  nlohmann::ordered_json series{{"file-series-version", "1.0"}, {"files", nlohmann::ordered_json::array()}};
  for (const Entry& entry : entries) series["files"].push_back({{"name", entry.name}, {"time", entry.time}});
  write_file(path, series.dump(1) + "\n");
}

}  // namespace

std::string snapshot_name(std::uint64_t number) { return fmt::format("snap_{:04}.hdf", number); }

void add_to_series(const std::filesystem::path& folder, const std::string& name, double time, const mpi::Comm& comm) {
  on_root(comm, [&] {
    const std::filesystem::path path = folder / "run.hdf.series";
    std::vector<Entry> entries = read_entries(path);
    std::erase_if(entries, [&](const Entry& entry) { return entry.name == name; });
    entries.push_back({name, time});
    write_entries(path, entries);
  });
}

void cut_series(const std::filesystem::path& folder, std::uint64_t first_number, const mpi::Comm& comm) {
  on_root(comm, [&] {
    const std::filesystem::path path = folder / "run.hdf.series";
    std::vector<Entry> entries = read_entries(path);
    const std::size_t before = entries.size();
    std::erase_if(entries, [&](const Entry& entry) {
      return std::ranges::find(entry.name, '_') != entry.name.end() &&
             std::strtoull(entry.name.c_str() + entry.name.find('_') + 1, nullptr, 10) >= first_number;
    });
    if (entries.size() != before) write_entries(path, entries);
  });
}

}  // namespace breccia::io

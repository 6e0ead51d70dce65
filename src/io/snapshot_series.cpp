#include "io/snapshot_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "breccia/error.hpp"
#include "io/collectively.hpp"
#include "io/durable_file.hpp"
#include "io/snapshot.hpp"

namespace breccia::io {

namespace {

namespace fs = std::filesystem;

constexpr const char* kSeries = "run.hdf.series";

struct Entry {
  std::string name;
  double time = 0.0;
};

// snap_0007.hdf: 7.
std::optional<std::uint64_t> number_of(const std::string& name) {
  const std::size_t begin = std::min(name.size(), std::string_view("snap_").size());
  std::uint64_t number = 0;
  std::from_chars(name.data() + begin, name.data() + name.size(), number);
  return name == snapshot_name(number) ? std::optional(number) : std::nullopt;
}

std::vector<Entry> read_list(const fs::path& path) {
  std::ifstream stream(path);
  const nlohmann::json series = nlohmann::json::parse(stream);
  std::vector<Entry> entries;
  for (const auto& file : series.at("files")) {
    entries.push_back({file.at("name").get<std::string>(), file.at("time").get<double>()});
  }
  return entries;
}

// The snapshots before number `end` in the folder by what they say themselves.
std::vector<Entry> snapshots_in(const fs::path& folder, std::uint64_t end) {
  std::vector<Entry> entries;
  std::error_code ignored;  // of a folder that cannot be read: what writes into it tells
  for (const fs::directory_entry& file : fs::directory_iterator(folder, ignored)) {
    const std::string name = file.path().filename().string();
    const std::optional<std::uint64_t> number = number_of(name);
    if (!number || *number >= end) continue;
    try {
      entries.push_back({name, read_snapshot_header(file.path()).time});
    } catch (const IoError& error) {
      fmt::print(stderr, "breccia: warning: {}; it is left out of {}\n", error.what(), kSeries);
    }
  }
  return entries;
}

// The entries before number `end`. A list that is damaged or gone is made anew.
std::vector<Entry> entries_before(const fs::path& folder, std::uint64_t end) {
  const fs::path path = folder / kSeries;
  if (!fs::exists(path)) return snapshots_in(folder, end);
  try {
    std::vector<Entry> entries = read_list(path);
    std::erase_if(entries, [&](const Entry& entry) { return number_of(entry.name).value_or(0) >= end; });
    return entries;
  } catch (const nlohmann::json::exception&) {
    fmt::print(stderr, "breccia: warning: {}: not a list of snapshots; it is made anew from the snapshots\n",
               path.string());
    return snapshots_in(folder, end);
  }
}

void write_entries(const fs::path& path, std::vector<Entry> entries) {
  std::ranges::stable_sort(entries, {}, &Entry::time);
  nlohmann::ordered_json series{{"file-series-version", "1.0"}, {"files", nlohmann::ordered_json::array()}};
  for (const Entry& entry : entries) series["files"].push_back({{"name", entry.name}, {"time", entry.time}});
  write_file(path, series.dump(1) + "\n");
}

}  // namespace

std::string snapshot_name(std::uint64_t number) { return fmt::format("snap_{:04}.hdf", number); }

void add_to_series(const fs::path& folder, std::uint64_t number, double time, const mpi::Comm& comm) {
  on_root(comm, [&] {
    std::vector<Entry> entries = entries_before(folder, number);
    entries.push_back({snapshot_name(number), time});
    write_entries(folder / kSeries, entries);
  });
}

void cut_series(const fs::path& folder, std::uint64_t first_number, const mpi::Comm& comm) {
  on_root(comm, [&] {
    const std::vector<Entry> entries = entries_before(folder, first_number);
    if (!entries.empty() || fs::exists(folder / kSeries)) write_entries(folder / kSeries, entries);
  });
}

}  // namespace breccia::io

// The files of text: diagnostics.csv, run.hdf.series, summary.json.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "breccia/error.hpp"
#include "io/diagnostics.hpp"
#include "io/snapshot.hpp"
#include "io/snapshot_series.hpp"
#include "io/summary.hpp"
#include "particles_for_test.hpp"

namespace breccia::io {
namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

// A different value in every column, none of which a short decimal number can express.
DiagnosticsRow row_of(int seed) {
  DiagnosticsRow row;
  double value = 1.0 / (seed + 3.0);
  for (const DiagnosticsColumn& column : diagnostics_columns()) {
    value = -1.7 * value;
    if (const auto* real = std::get_if<double DiagnosticsRow::*>(&column.value)) row.*(*real) = value;
    if (const auto* whole = std::get_if<std::uint64_t DiagnosticsRow::*>(&column.value)) {
      row.*(*whole) = std::numeric_limits<std::uint64_t>::max() / static_cast<std::uint64_t>(seed + 2);
    }
  }
  row.min_J = std::numeric_limits<double>::denorm_min();
  row.max_J = std::nextafter(1.0, 2.0);
  return row;
}

TEST(Diagnostics, EveryNumberComesBack) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("diagnostics", comm);
  const auto path = folder.path() / "diagnostics.csv";
  DiagnosticsWriter writer(path, comm);
  for (int i = 0; i < 3; ++i) writer.write(row_of(i));

  std::ifstream stream(path);  // the writer still has it open: rows are there as soon as they are written
  std::string line;
  std::getline(stream, line);
  const auto columns = diagnostics_columns();
  const std::vector<std::string> names = split(line);
  ASSERT_EQ(names.size(), columns.size());
  EXPECT_EQ(names.front(), "time [s]");
  EXPECT_EQ(names.back(), "wall_seconds [s]");
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(std::getline(stream, line));
    const std::vector<std::string> cells = split(line);
    ASSERT_EQ(cells.size(), columns.size());
    const DiagnosticsRow expected = row_of(i);
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (const auto* real = std::get_if<double DiagnosticsRow::*>(&columns[c].value)) {
        EXPECT_EQ(std::strtod(cells[c].c_str(), nullptr), expected.*(*real)) << names[c];
      } else {
        EXPECT_EQ(std::stoull(cells[c]), expected.*std::get<std::uint64_t DiagnosticsRow::*>(columns[c].value));
      }
    }
  }
  EXPECT_FALSE(std::getline(stream, line));
}

nlohmann::json read_json(const std::filesystem::path& path) {
  std::ifstream stream(path);
  return nlohmann::json::parse(stream);
}

TEST(Series, EndsWithTheSnapshotThatIsWritten) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("series", comm);
  const nlohmann::json first = {{"name", "snap_0000.hdf"}, {"time", 0.0}};
  const nlohmann::json again = {{"name", "snap_0001.hdf"}, {"time", 500.0}};
  const nlohmann::json last = {{"name", "snap_10000.hdf"}, {"time", 1.0e5}};
  const auto files = [&] {
    comm.barrier();
    const nlohmann::json series = read_json(folder.path() / "run.hdf.series");
    EXPECT_EQ(series.at("file-series-version"), "1.0");
    nlohmann::json listed = series.at("files");
    comm.barrier();
    return listed;
  };
  add_to_series(folder.path(), 0, 0.0, comm);
  add_to_series(folder.path(), 1, 1000.0 / 3.0, comm);
  add_to_series(folder.path(), 9999, 2000.0, comm);
  add_to_series(folder.path(), 1, 500.0, comm);  // written again after a restart
  EXPECT_EQ(files(), nlohmann::json::array({first, again}));
  add_to_series(folder.path(), 10000, 1.0e5, comm);
  EXPECT_EQ(files(), nlohmann::json::array({first, again, last}));
  cut_series(folder.path(), 10000, comm);
  EXPECT_EQ(files(), nlohmann::json::array({first, again}));
  cut_series(folder.path(), 0, comm);
  EXPECT_EQ(files(), nlohmann::json::array());
  EXPECT_EQ(test::names_in(folder.path()), std::vector<std::string>{"run.hdf.series"});
}

// From the snapshots themselves; one that cannot be read, later ones and files of other names are no part of it.
TEST(Series, ADamagedListIsMadeAnew) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("damaged_series", comm);
  for (const std::uint64_t number : {0, 1, 2, 5}) {
    SnapshotHeader header;
    header.time = 10.0 * static_cast<double>(number);
    write_snapshot(folder.path() / snapshot_name(number), header, test::scattered_particles(5, comm), {}, comm);
  }
  for (const bool gone : {false, true}) {
    if (comm.is_root()) {
      std::ofstream(folder.path() / "run.hdf.series") << "{\"files\": [";
      if (gone) std::filesystem::remove(folder.path() / "run.hdf.series");
      std::ofstream(folder.path() / "snap_0001.hdf") << "short";
      std::ofstream(folder.path() / "snap_00.hdf") << "";
    }
    comm.barrier();
    add_to_series(folder.path(), 3, 35.0, comm);
    comm.barrier();
    const nlohmann::json expected = {{{"name", "snap_0000.hdf"}, {"time", 0.0}},
                                     {{"name", "snap_0002.hdf"}, {"time", 20.0}},
                                     {{"name", "snap_0003.hdf"}, {"time", 35.0}}};
    EXPECT_EQ(read_json(folder.path() / "run.hdf.series").at("files"), expected);
    comm.barrier();
  }
}

TEST(Summary, HasTheKeysOtherProgramsRelyOn) {
  const mpi::Comm comm;
  const test::ScratchFolder folder("summary", comm);
  RunSummary summary;
  summary.particles = 1000000;
  summary.steps = 300;
  summary.simulated_time = 1.0e5;
  summary.wall_seconds = 60.0;
  summary.precision = "mixed";
  summary.conservation = {0.0, 1.0e-16, 2.0e-12, -3.0e-4};
  summary.remnants.push_back({{"mass", 1.0e18}, {"class", "bilobed"}});
  summary.stages.push_back({"p2g", 20.0, 300});
  summary.scene = {{"grid.cell", "2500 m", true}, {"time.cfl", "0.4", false}, {"gravity.softening", "125 m", true}};
  summary.unused_keys = {"gravity.softening"};
  write_summary(folder.path() / "summary.json", summary, comm);
  comm.barrier();

  const nlohmann::json json = read_json(folder.path() / "summary.json");
  for (const char* key : {"particles", "steps", "simulated_time", "wall_seconds", "ranks", "threads", "device",
                          "precision", "particle_steps_per_second", "conservation", "damaged_fraction", "remnants",
                          "scene", "versions", "machine", "stages", "used", "unused"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_DOUBLE_EQ(json.at("particle_steps_per_second"), 5.0e6);
  EXPECT_EQ(json.at("conservation").at("energy"), -3.0e-4);
  EXPECT_EQ(json.at("remnants").at(0).at("class"), "bilobed");
  EXPECT_EQ(json.at("scene").at("grid.cell"), "2500 m");
  EXPECT_EQ(json.at("used"), nlohmann::json{"grid.cell"});
  EXPECT_EQ(json.at("unused"), nlohmann::json{"gravity.softening"});
  EXPECT_EQ(json.at("versions").at("breccia"), BRECCIA_VERSION);
  EXPECT_FALSE(json.at("machine").at("cpu_model").get<std::string>().empty());
}

}  // namespace
}  // namespace breccia::io

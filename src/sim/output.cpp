#include "sim/output.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <utility>

#include "analysis/remnants.hpp"
#include "io/output_folder.hpp"
#include "io/remnants_json.hpp"
#include "io/snapshot.hpp"
#include "io/snapshot_series.hpp"
#include "sim/same_scene.hpp"

namespace breccia::sim {
namespace {

constexpr double kDefaultRows = 200.0;  // diagnostics rows of a run whose scene does not say how often

double target_mass(const Scene& scene) {
  double heaviest = 0.0;
  for (const BodyParameters& b : scene.bodies) heaviest = std::max(heaviest, b.mass);
  return heaviest;
}

}  // namespace

Output::Output(const Scene& scene, const std::filesystem::path& folder, double end,
               const std::vector<ResolvedKey>& keys, const std::optional<Restart>& restart, Budget& budget,
               const mpi::Comm& comm)
    : scene_(scene),
      scene_keys_(lasting_keys(keys)),
      folder_(folder),
      comm_(comm),
      budget_(budget),
      diagnostics_(restart ? io::DiagnosticsWriter(folder_ / "diagnostics.csv", restart->run.loop.step, comm)
                           : io::DiagnosticsWriter(folder_ / "diagnostics.csv", comm)),
      snapshots_(scene.output.snapshot_interval),
      rows_(scene.output.diagnostics_interval > 0.0 ? scene.output.diagnostics_interval : end / kDefaultRows) {
  if (restart) {
    const OutputState& state = restart->run.output;
    snapshots_.restore(state.snapshots, restart->run.loop.time);
    rows_.restore(state.rows, restart->run.loop.time);
    next_analysis_ = state.next_analysis;
    snapshot_number_ = state.snapshot_number;
    last_row_ = restart->run.budget.first;
  }
  io::cut_series(folder_, snapshot_number_, comm_);
}

void Output::at(const TimeLoop& loop, bool force) {
  const bool snapshot = snapshots_.due(loop.time(), loop.dt()) || force || std::exchange(snapshot_wanted_, false);
  const bool row = rows_.due(loop.time(), loop.dt()) || force;
  const bool analysis = analysis_due(loop);
  if (!snapshot && !row && !analysis) return;
  loop.finish_steps();
  loop.timers()("output", [&] {
    const ParticleOutput particles = loop.engine().observe();
    if (row) write_row(loop, particles);
    if (snapshot) write_snapshot(loop, particles);
    if (analysis) print_remnants(particles, loop.time());
  });
}

nlohmann::json Output::remnants(const ParticleOutput& particles) const {
  const double link = scene_.output.link_cells * scene_.cell;
  const std::vector<double> potential = budget_.potential(particles);
  return io::remnants_json(analysis::find_fragments(particles, link, target_mass(scene_), comm_, potential).remnants);
}

bool Output::analysis_due(const TimeLoop& loop) {
  bool due = false;
  while (next_analysis_ < scene_.output.analysis_times.size() &&
         scene_.output.analysis_times[next_analysis_] <= loop.time() + 0.5 * loop.dt()) {
    ++next_analysis_;
    due = true;
  }
  return due;
}

void Output::write_row(const TimeLoop& loop, const ParticleOutput& particles) {
  const std::uint64_t clamped_before = last_row_.clamped_volumes;
  last_row_ = budget_.row(loop.engine(), particles, loop.lost_work());
  if (clamped_before == 0 && last_row_.clamped_volumes > 0) warn_of_clamped(loop.time());
  last_row_.time = loop.time();
  last_row_.step = loop.step();
  last_row_.dt = loop.dt();
  last_row_.imbalance = loop.balance().imbalance;
  last_row_.recuts = loop.balance().recuts;
  last_row_.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  diagnostics_.write(last_row_);
}

void Output::warn_of_clamped(double time) const {
  if (!comm_.is_root()) return;
  fmt::print(stderr,
             "breccia: warning: until t = {:.6g} s, {} volume changes of a particle were cut, the grid asking for "
             "det(I + dt L) <= 0.1 in one step; clamped_volumes in diagnostics.csv counts them, a smaller time.step or "
             "time.cfl avoids them\n",
             time, last_row_.clamped_volumes);
}

void Output::write_snapshot(const TimeLoop& loop, const ParticleOutput& particles) {
  io::SnapshotHeader header;
  header.time = loop.time();
  header.step = loop.step();
  header.cell = scene_.cell;
  header.target_mass = target_mass(scene_);
  header.scene_name = scene_.name;
  header.scene_keys = scene_keys_;
  const std::uint64_t number = snapshot_number_++;
  const auto start = std::chrono::steady_clock::now();
  io::write_snapshot(folder_ / io::snapshot_name(number), header, particles, scene_.output.fields, comm_);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  longest_write_ = std::max(longest_write_, seconds);
  io::add_to_series(folder_, number, loop.time(), comm_);
}

void Output::print_remnants(const ParticleOutput& particles, double time) {
  const nlohmann::json found = remnants(particles);
  if (!comm_.is_root() || found.empty()) return;
  const auto& largest = found.front();
  fmt::print("t = {:.6g} s: {} remnants, largest M/M_target = {:.4f}, b/a = {:.3f}, c/a = {:.3f}, {}\n", time,
             found.size(), largest["mass_over_target"].get<double>(), largest["b_over_a"].get<double>(),
             largest["c_over_a"].get<double>(), largest["class"].get<std::string>());
}

}  // namespace breccia::sim

// What a run writes as it goes: rows of diagnostics, snapshots, remnants.
#pragma once

#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "breccia/scene.hpp"
#include "io/diagnostics.hpp"
#include "mpi/comm.hpp"
#include "sim/checkpoints.hpp"
#include "sim/diagnostics.hpp"
#include "sim/run_state.hpp"
#include "sim/time_loop.hpp"

namespace breccia::sim {

/// Output times are multiples of an interval; the step nearest to each is taken, so output never changes dt.
class Schedule {
 public:
  explicit Schedule(double interval) : interval_(interval), next_(interval > 0.0 ? interval : HUGE_VAL) {}
  /// Goes on after a restart at `time`, also where the scene asks for another interval now.
  void restore(const ScheduleState& state, double time) {
    if (state.interval == interval_) {
      next_ = state.next;
    } else if (interval_ > 0.0) {
      next_ = interval_ * std::max(1.0, std::ceil(time / interval_));
    }
  }
  [[nodiscard]] ScheduleState state() const { return {interval_, next_}; }
  /// Whether the step of length `dt` at `time` is the one; then the next time is.
  bool due(double time, double dt) {
    if (time + 0.5 * dt < next_) return false;
    while (next_ <= time + 0.5 * dt) next_ += interval_;
    return true;
  }

 private:
  double interval_;
  double next_;
};

/// Everything a run writes but checkpoints and the summary.
class Output {
 public:
  /// `end`: of the run [s]. `keys`: of the scene as resolved, for the snapshots. Goes on where `restart` says.
  /// Collective.
  Output(const Scene& scene, const std::filesystem::path& folder, double end, const std::vector<ResolvedKey>& keys,
         const std::optional<Restart>& restart, Budget& budget, const mpi::Comm& comm);

  [[nodiscard]] OutputState state() const {
    return {snapshots_.state(), rows_.state(), next_analysis_, snapshot_number_, 0.0};
  }
  /// A snapshot at the next t_n, whether due or not.
  void want_snapshot() { snapshot_wanted_ = true; }
  /// Writes what is due at this t_n; all of it if `force`. Collective.
  void at(const TimeLoop& loop, bool force);

  /// As summary.json has them. Collective.
  [[nodiscard]] nlohmann::json remnants(const ParticleOutput& particles) const;
  [[nodiscard]] const io::DiagnosticsRow& last_row() const { return last_row_; }
  /// Of all snapshots of this program so far [s].
  [[nodiscard]] double longest_write() const { return longest_write_; }

 private:
  bool analysis_due(const TimeLoop& loop);
  void write_row(const TimeLoop& loop, const ParticleOutput& particles);
  void warn_of_clamped(double time) const;
  void write_snapshot(const TimeLoop& loop, const ParticleOutput& particles);
  void print_remnants(const ParticleOutput& particles, double time);

  const Scene& scene_;
  std::string scene_keys_;
  std::filesystem::path folder_;
  mpi::Comm comm_;
  Budget& budget_;
  io::DiagnosticsWriter diagnostics_;
  Schedule snapshots_;
  Schedule rows_;
  std::size_t next_analysis_ = 0;
  std::uint64_t snapshot_number_ = 0;
  bool snapshot_wanted_ = false;
  double longest_write_ = 0.0;
  io::DiagnosticsRow last_row_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace breccia::sim

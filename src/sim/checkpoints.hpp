// When a run writes checkpoints, and which one it continues from.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "breccia/scene.hpp"
#include "io/checkpoint.hpp"
#include "mpi/comm.hpp"
#include "sim/run_state.hpp"

namespace breccia::sim {

/// A checkpoint as a run continues from it.
struct Restart {
  EngineState engine;
  RunState run;
  std::uint64_t next_number = 0;  ///< of the checkpoint that follows
};

/// The checkpoint `which`: a file, or "auto" for the newest one of `folder` that is whole; damaged ones are named in a
/// warning. Empty if it is "auto" and the folder has none. Collective. Throws IoError if the file is damaged or all of
/// them are, UsageError if it is of another scene (require_same_scene); the same on all ranks.
std::optional<Restart> find_restart(const std::string& which, const std::filesystem::path& folder, const Scene& scene,
                                    const std::vector<ResolvedKey>& keys, const mpi::Comm& comm);

/// Writes checkpoints of one run.
class Checkpoints {
 public:
  /// `time`: simulated time at the start of this program. `first_number`: Restart::next_number.
  Checkpoints(const std::filesystem::path& folder, const OutputParameters& output, double time,
              std::uint64_t first_number, const mpi::Comm& comm);

  /// True on all ranks if the interval of wall time or of simulated time is over, or if the run will end within this
  /// window, so that a later end costs a window, not the run. Collective.
  [[nodiscard]] bool due(double time, bool last_window) const;
  /// Writes one and removes those that are too many; returns its name. Collective. Throws IoError.
  std::string write(const EngineState& engine, const RunState& run);
  /// Wall time the last one took [s].
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  using Clock = std::chrono::steady_clock;
  std::filesystem::path folder_;
  OutputParameters output_;
  mpi::Comm comm_;
  std::uint64_t next_number_;
  double last_time_ = 0.0;
  Clock::time_point last_wall_ = Clock::now();
  double seconds_ = 0.0;
};

}  // namespace breccia::sim

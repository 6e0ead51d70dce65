// What happens where a window begins: checkpoints, and the end of a run that is told to stop.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "sim/checkpoints.hpp"
#include "sim/diagnostics.hpp"
#include "sim/output.hpp"
#include "sim/run.hpp"
#include "sim/stop_requests.hpp"
#include "sim/time_loop.hpp"

namespace breccia::sim {

class Interruptions {
 public:
  /// `time`: simulated time at the start of this program; `wall_before`: wall time of the run before it [s].
  Interruptions(const RunOptions& options, const Scene& scene, double time, Output& output, const Budget& budget,
                double wall_before, std::uint64_t first_checkpoint, const mpi::Comm& comm);

  /// False if the run is to stop; its checkpoint is written then. `last_window`: it will end within this window.
  /// Collective.
  bool at_window_start(const TimeLoop& loop, bool last_window);
  /// Throws Error with the exit code of a stopped run if the run was stopped.
  void end_if_stopped() const;

 private:
  using Clock = std::chrono::steady_clock;

  void write(const TimeLoop& loop);

  const RunOptions& options_;
  Output& output_;
  const Budget& budget_;
  double wall_before_;
  Clock::time_point start_ = Clock::now();
  StopRequests requests_;
  Checkpoints checkpoints_;
  Clock::time_point window_start_ = start_;
  double longest_window_ = 0.0;
  std::string name_;
  std::string stopped_;
};

}  // namespace breccia::sim

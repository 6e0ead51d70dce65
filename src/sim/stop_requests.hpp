// How a running program is told to stop or to write: signals, files in the output folder, the wall time it was given.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>

#include "mpi/comm.hpp"

namespace breccia::sim {

/// What is asked for, the same on all ranks.
struct Requests {
  const char* stop = nullptr;  ///< why; null: go on
  bool snapshot = false;
};

/// From here to the end of the program SIGUSR1, SIGTERM and SIGINT do not end it but wait to be polled; in vain, if
/// nothing is left to be stopped. A second SIGINT ends it at once.
void keep_stop_signals();

/// What asks the run in `folder` to stop.
class StopRequests {
 public:
  /// `walltime`: this many seconds after `start` the program must have ended.
  StopRequests(const std::filesystem::path& folder, std::optional<double> walltime,
               std::chrono::steady_clock::time_point start, const mpi::Comm& comm);

  /// What any rank was asked for since the last call; files asked with are removed. `reserve`: seconds that stopping
  /// and another window may take. Collective.
  Requests poll(double reserve);

 private:
  std::filesystem::path folder_;
  std::optional<double> walltime_;
  std::chrono::steady_clock::time_point start_;
  mpi::Comm comm_;
};

}  // namespace breccia::sim

// What a person sees while a run goes on: one line kept up to date on a terminal, plain lines now and then elsewhere.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "mpi/comm.hpp"

namespace breccia::sim {

class Progress {
 public:
  /// From `time` and `step` on. `end`: when the run ends [s]; `max_steps`: or after this many steps (0: no limit).
  Progress(double time, std::uint64_t step, double end, std::uint64_t max_steps, std::uint64_t particles,
           const mpi::Comm& comm);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Prints percent, time, step, dt, particle-steps/s and time left if it is time to; the root does.
  void update(double time, std::uint64_t step, double dt);

 private:
  [[nodiscard]] double fraction(double time, std::uint64_t step) const;
  [[nodiscard]] std::string line(double elapsed, double time, std::uint64_t step, double dt) const;

  using Clock = std::chrono::steady_clock;
  double start_time_;
  std::uint64_t start_step_;
  double end_;
  std::uint64_t max_steps_;
  double particles_;
  bool root_;
  bool terminal_;
  bool printed_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_ = start_;
};

/// "1 h 02 min", "3 min 20 s", "12 s".
std::string duration_text(double seconds);

}  // namespace breccia::sim

#include "sim/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace breccia::sim {
namespace {

constexpr auto kTerminalPeriod = std::chrono::milliseconds(250);
constexpr auto kPlainPeriod = std::chrono::seconds(30);

}  // namespace

std::string duration_text(double seconds) {
  const auto s = static_cast<long>(std::lround(seconds));
  if (s >= 3600) return fmt::format("{} h {:02} min", s / 3600, s / 60 % 60);
  if (s >= 60) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} s", s);
}

Progress::Progress(double time, std::uint64_t step, double end, std::uint64_t max_steps, std::uint64_t particles,
                   const mpi::Comm& comm)
    : start_time_(time),
      start_step_(step),
      end_(end),
      max_steps_(max_steps),
      particles_(static_cast<double>(particles)),
      root_(comm.is_root()),
      terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  if (printed_ && terminal_) fmt::print(stderr, "\n");
}

void Progress::update(double time, std::uint64_t step, double dt) {
  if (!root_) return;
  const auto now = Clock::now();
  if (now < next_ || step == start_step_) return;
  next_ = now + (terminal_ ? Clock::duration(kTerminalPeriod) : Clock::duration(kPlainPeriod));
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  fmt::print(stderr, fmt::runtime(terminal_ ? "\r{}\033[K" : "{}\n"), line(elapsed, time, step, dt));
  std::fflush(stderr);
  printed_ = true;
}

double Progress::fraction(double time, std::uint64_t step) const {
  double done = end_ > 0.0 ? time / end_ : 1.0;
  if (max_steps_ != 0) done = std::max(done, static_cast<double>(step) / static_cast<double>(max_steps_));
  return std::min(done, 1.0);
}

std::string Progress::line(double elapsed, double time, std::uint64_t step, double dt) const {
  const double rate = particles_ * static_cast<double>(step - start_step_) / elapsed;
  const double done = fraction(time, step);
  const double done_here = done - fraction(start_time_, start_step_);
  return fmt::format("{:5.1f} %  t = {:.6g} s  step {}  dt = {:.4g} s  {:.3g} M particle-steps/s  {} left",
                     100.0 * done, time, step, dt, 1e-6 * rate,
                     done_here > 0.0 ? duration_text(elapsed * (1.0 - done) / done_here) : "?");
}

}  // namespace breccia::sim

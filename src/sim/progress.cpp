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

Progress::Progress(double end, std::uint64_t max_steps, std::uint64_t particles, const mpi::Comm& comm)
    : end_(end),
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
  if (now < next_ || step == 0) return;
  next_ = now + (terminal_ ? Clock::duration(kTerminalPeriod) : Clock::duration(kPlainPeriod));
  double fraction = end_ > 0.0 ? time / end_ : 1.0;
  if (max_steps_ != 0) {
    fraction = std::max(fraction, static_cast<double>(step) / static_cast<double>(max_steps_));
  }
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  fmt::print(stderr, fmt::runtime(terminal_ ? "\r{}\033[K" : "{}\n"),
             line(std::min(fraction, 1.0), elapsed, time, step, dt));
  std::fflush(stderr);
  printed_ = true;
}

std::string Progress::line(double fraction, double elapsed, double time, std::uint64_t step, double dt) const {
  const double rate = particles_ * static_cast<double>(step) / elapsed;
  return fmt::format("{:5.1f} %  t = {:.6g} s  step {}  dt = {:.4g} s  {:.3g} M particle-steps/s  {} left",
                     100.0 * fraction, time, step, dt, 1e-6 * rate,
                     fraction > 0.0 ? duration_text(elapsed * (1.0 - fraction) / fraction) : "?");
}

}  // namespace breccia::sim

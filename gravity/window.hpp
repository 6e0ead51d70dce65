// When gravity is evaluated, and for which time (gravity.md 4, physics.md 5).
#pragma once

#include <string>

#include "breccia/error.hpp"

namespace breccia::gravity {

/// Gravity is evaluated every `interval` steps and held in between. The kicks of one window act at its steps
/// 0 .. interval-1, so their mean time is (interval - 1)/2 steps after its start; an acceleration taken at positions
/// drifted to that time makes the held kicks a drift-kick-drift leapfrog. Half a step more or less spins bodies up.
class Window {
 public:
  /// `phase` is the step inside the window, as phase() gave it before a restart. Throws UsageError.
  explicit Window(int interval, int phase = 0) : interval_(interval), phase_(phase) {
    if (interval < 1) throw UsageError("gravity.interval = " + std::to_string(interval) + ": must be at least 1");
    if (phase < 0 || phase >= interval) {
      throw UsageError("gravity window: phase " + std::to_string(phase) + " lies outside 0 .. " +
                       std::to_string(interval - 1));
    }
  }

  /// True at the first step of a window: gravity is to be evaluated before it, and dt may change.
  [[nodiscard]] bool due() const { return phase_ == 0; }
  /// How far to drift positions, with the velocities of the half step before, ahead of an evaluation [s].
  [[nodiscard]] double prediction_time(double dt) const { return 0.5 * (interval_ - 1) * dt; }
  /// One step is done.
  void advance() { phase_ = (phase_ + 1) % interval_; }

  [[nodiscard]] int interval() const { return interval_; }
  [[nodiscard]] int phase() const { return phase_; }

 private:
  int interval_;
  int phase_;
};

}  // namespace breccia::gravity

// Which tasks of a sweep are done. Threads wait for single tasks by it instead of for all of a phase.
#pragma once

#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

#include "grid/sweep_plan.hpp"

namespace breccia::grid {

class SweepBoard {
 public:
  explicit SweepBoard(const std::vector<SweepPhase>& phases) {
    done_.reserve(phases.size());
    for (const SweepPhase& phase : phases) done_.emplace_back(phase.size());
  }

  /// Returns once those tasks of the phase before are done that `task` comes after. Some thread must have taken each of
  /// them before.
  void wait_for_turn(std::size_t phase, const SweepTask& task) const {
    for (std::size_t n = task.after_first; n < task.after_last; ++n) {
      while (!done_[phase - 1][n].load(std::memory_order_acquire)) std::this_thread::yield();
    }
  }
  void finish(std::size_t phase, std::size_t task) { done_[phase][task].store(true, std::memory_order_release); }

 private:
  std::vector<std::vector<std::atomic<bool>>> done_;
};

}  // namespace breccia::grid

// Who does what next in a sweep, while threads are at it. A plane is passed over once those next to it of a lower turn
// are, and its grid is updated once nobody will read its old velocities or add to it any more: as soon as it and both
// neighbours are passed over, while its nodes are still in the cache.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "grid/sweep_plan.hpp"

namespace breccia::grid {

struct SweepWork {
  enum class Kind : std::uint8_t { kPass, kUpdate };
  Kind kind;
  std::uint32_t plane;
};

class SweepBoard {
 public:
  /// Of `part`, which must stay as it is; `updates`: whether the grid update trails the passes.
  SweepBoard(const SweepPart& part, bool updates);

  /// What the thread of this home does next: of its own planes the lowest that is ready, else one that another has left
  /// till last. Nothing if all is waiting for what other threads do, or all_taken().
  [[nodiscard]] std::optional<SweepWork> take(int home);
  /// To be called after the work is done that was taken.
  void finish(SweepWork work);
  /// Nothing is left for anybody to take.
  [[nodiscard]] bool all_taken() const { return open_ == 0; }

 private:
  enum class State : std::uint8_t { kOpen, kTaken, kDone };

  [[nodiscard]] bool passed(std::uint32_t plane) const { return plane == kNoPlane || pass_[plane] == State::kDone; }
  [[nodiscard]] bool pass_ready(std::uint32_t plane) const;
  [[nodiscard]] bool update_ready(std::uint32_t plane) const;
  [[nodiscard]] std::optional<SweepWork> ready(std::uint32_t plane) const;

  std::mutex mutex_;
  const SweepPart& part_;
  std::vector<State> pass_;
  std::vector<State> update_;
  std::vector<std::uint32_t> lowest_;  // of each home, the first plane that may have something open
  std::atomic<std::size_t> open_;      // passes and updates that nobody has taken
};

}  // namespace breccia::grid

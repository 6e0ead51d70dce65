// In which order the tiles of a rank are passed over, by which thread, and when the grid update trails behind.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "grid/layout.hpp"

namespace breccia::grid {

/// A step of a sweep: pass over the tiles order[first] .. order[last - 1], or update the grid in the blocks of the
/// tiles first .. last-1.
struct SweepStep {
  std::uint32_t first, last;
  bool update;
};
/// Steps that one thread does in this order, once the tasks after_first .. after_last-1 of the phase before are done.
struct SweepTask {
  std::vector<SweepStep> steps;
  std::size_t after_first = 0;
  std::size_t after_last = 0;
};
/// Tasks that may run at once.
using SweepPhase = std::vector<SweepTask>;

struct Sweep {
  std::vector<std::uint32_t> order;  ///< tiles, those of the boundary first
  std::vector<SweepPhase> boundary;  ///< tiles that reach nodes shared with other ranks
  std::vector<SweepPhase> interior;
};

/// Turn of a plane of blocks: planes of one turn share no node; where planes do, that of the lower turn adds first.
/// `period`: blocks along x, 0 if x does not repeat. On a periodic axis of an odd number of blocks the last plane lies
/// between two even ones.
constexpr int sweep_turn(std::int32_t x, std::int32_t period) {
  const bool odd_one_out = period % 2 == 1 && x == period - 1;
  return odd_one_out ? 2 : x & 1;
}

/// `tiles`: keys of the lowest blocks of their stacks, in order; `boundary`: for each tile, whether it is of the
/// boundary. `period` as above.
[[nodiscard]] Sweep plan_sweep(std::span<const BlockKey> tiles, std::span<const char> boundary, std::int32_t period,
                               int threads);

}  // namespace breccia::grid

// What a pass over the tiles of a rank consists of: planes of blocks, which of them wait for which, and the thread at
// which each is at home. What runs when is decided while it runs (sweep_board.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "grid/layout.hpp"

namespace breccia::grid {

inline constexpr std::uint32_t kNoPlane = 0xffffffffU;

/// The tiles of one plane of blocks across x.
struct SweepPlane {
  std::uint32_t first_tile = 0, last_tile = 0;  ///< all of them
  std::uint32_t first = 0, last = 0;            ///< in Sweep::order: those that the part passes over
  std::uint32_t left = kNoPlane;                ///< planes next to it, of the same part
  std::uint32_t right = kNoPlane;
  int turn = 0;  ///< planes next to each other differ; where two add to the same node, that of the lower turn is first
};

/// Planes in ascending order.
struct SweepPart {
  std::vector<SweepPlane> planes;
  /// Thread t is at home in the planes homes[t] .. homes[t + 1] - 1, of about the same cost for each: what it worked on
  /// in the last pass lies in its caches.
  std::vector<std::uint32_t> homes;
};

struct Sweep {
  std::vector<std::uint32_t> order;  ///< tiles, those of the boundary first
  SweepPart boundary;                ///< tiles that reach nodes shared with other ranks
  SweepPart interior;                ///< all others; runs once the boundary is done
};

/// Turn of a plane of blocks: planes of one turn share no node; where planes do, that of the lower turn adds first.
/// `period`: blocks along x, 0 if x does not repeat. On a periodic axis of an odd number of blocks the last plane lies
/// between two even ones.
constexpr int sweep_turn(std::int32_t x, std::int32_t period) {
  const bool odd_one_out = period % 2 == 1 && x == period - 1;
  return odd_one_out ? 2 : x & 1;
}

/// What plan_sweep looks at of a tile.
struct SweepTile {
  BlockKey stack;  ///< lowest block
  bool boundary;
  double cost;  ///< in any unit
};

/// `tiles` in the order of their keys; `period` as above.
[[nodiscard]] Sweep plan_sweep(std::span<const SweepTile> tiles, std::int32_t period, int threads);

}  // namespace breccia::grid

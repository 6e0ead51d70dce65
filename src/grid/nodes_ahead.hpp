// Asks for the nodes of the next tile while a tile is passed over. Where a rank's particles and nodes outgrow the
// cache, nodes come from memory in every step, from some two hundred places at once: more than the processor sees
// coming.
#pragma once

#include "grid/tile_nodes.hpp"

namespace breccia::grid {

template <class P>
class NodesAhead {
  using Real = typename P::Real;

 public:
  /// While `tile` is passed over, for those of `ahead`, or none (kNoTile).
  BRECCIA_HD NodesAhead(const PassArguments<P>& arguments, const Tile& tile, std::uint32_t ahead)
      : a_(arguments), packs_(static_cast<int>((tile.particles + P::kLanes - 1) / P::kLanes)) {
    if (ahead != kNoTile) ahead_ = a_.tiles + ahead;
  }

  /// To be called with each pack in turn: the parts are spread over all of them, as only some ten lines can be under
  /// way at once.
  BRECCIA_HD void ask(int pack) {
    if (ahead_ == nullptr) return;
    const int last = (pack + 1) * kParts / packs_;
    for (; next_ < last; ++next_) ask_for(next_);
  }

 private:
  // Tiles come in the order of x, y, z: the one before in y has reached the lower half of the columns, the one below
  // the lowest nodes. The first tiles of a row do without.
  static constexpr int kNewColumns = kTileWidth - 2 * kTileMargin;
  static constexpr int kNewHeight = kTileHeight - 2 * kTileMargin;
  static constexpr int kArrays = kNodePairs<P> ? 3 : 2;  // sums, and velocities in one or two
  static constexpr int kParts = kTileWidth * kNewColumns * kArrays;

  BRECCIA_HD void ask_for(int part) const {
    const int column = part / kArrays;
    const int x = column / kNewColumns;
    const int y = kTileWidth - kNewColumns + column % kNewColumns;
    // Thin tiles reach few.
    const TileBox& starts = ahead_->starts;
    if (x < starts.low[0] || x > starts.high[0] + 2 || y < starts.low[1] || y > starts.high[1] + 2) return;
    const std::size_t place = TileNodes<P>::place(*ahead_, x, y) + 2 * kTileMargin;
    if (part % kArrays == 0) {
      if (a_.scatter) ask_lines<kChannels>(a_.sums + place * kChannels);
    } else if (a_.gather) {
      const std::size_t array = part % kArrays == 1 ? 0 : rest_distance(a_.places);
      ask_lines<kVelocityStride<P>>(a_.velocities + place * kVelocityStride<P> + array);
    }
  }

  template <int kStride>
  BRECCIA_HD static void ask_lines(const Real* first) {
    constexpr int kLine = static_cast<int>(64 / sizeof(Real));
    // Columns begin at pairs of nodes, which may be half a line.
    constexpr int kLines = kNewHeight * kStride / kLine + (2 * kStride < kLine ? 1 : 0);
    for (int n = 0; n < kLines; ++n) __builtin_prefetch(first + n * kLine, 0, 2);
  }

  const PassArguments<P>& a_;
  int packs_;
  const Tile* ahead_ = nullptr;
  int next_ = 0;
};

}  // namespace breccia::grid

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
  /// Asks for the nodes of tile `ahead` while `tile` is passed over; for none if it is kNoTile.
  BRECCIA_HD NodesAhead(const PassArguments<P>& arguments, const Tile& tile, std::uint32_t ahead)
      : a_(arguments), packs_(static_cast<int>((tile.particles + P::kLanes - 1) / P::kLanes)), ahead_(ahead) {}

  /// To be called with each pack in turn: what is asked for is spread over all of them, as only some ten lines can be
  /// under way at once.
  BRECCIA_HD void ask(int pack) {
    for_each_line(pack, [](const Real* line) BRECCIA_INLINE_LAMBDA { __builtin_prefetch(line, 0, 2); });
  }

  /// Calls visit(some place in the line) for the lines of the cache to be asked for with this pack.
  template <class F>
  BRECCIA_HD void for_each_line(int pack, F&& visit) {
    if (ahead_ == kNoTile) return;
    const int last = (pack + 1) * kParts / packs_;
    for (; next_ < last; ++next_) visit_part(next_, visit);
  }

 private:
  // Tiles come in the order of x, y, z: the one before in y has reached the lower half of the columns, the one below
  // the lowest nodes. The first tiles of a row do without.
  static constexpr int kNewColumns = kTileWidth - 2 * kTileMargin;
  static constexpr int kFirstNew = 2 * kTileMargin;
  static constexpr int kArrays = kNodePairs<P> ? 3 : 2;  // sums, and velocities in one or two
  static constexpr int kParts = kTileWidth * kNewColumns * kArrays;

  template <class F>
  BRECCIA_HD void visit_part(int part, F&& visit) const {
    const int column = part / kArrays;
    const int x = column / kNewColumns;
    const int y = kTileWidth - kNewColumns + column % kNewColumns;
    // Thin tiles reach few.
    const TileBox& starts = a_.tiles[ahead_].starts;
    const int height = starts.high[2] + 3 - kFirstNew;
    if (x < starts.low[0] || x > starts.high[0] + 2 || y < starts.low[1] || y > starts.high[1] + 2 || height <= 0)
      return;
    const auto place = [&](const Tile* tiles)
                           BRECCIA_INLINE_LAMBDA { return TileNodes<P>::place(tiles[ahead_], x, y) + kFirstNew; };
    if (part % kArrays == 0) {
      if (a_.scatter) visit_lines<kChannels>(a_.sums + place(a_.targets) * kChannels, height, visit);
    } else if (a_.gather) {
      const std::size_t array = part % kArrays == 1 ? 0 : rest_distance(a_.places);
      visit_lines<kVelocityStride<P>>(a_.velocities + place(a_.tiles) * kVelocityStride<P> + array, height, visit);
    }
  }

  template <int kStride, class F>
  BRECCIA_HD static void visit_lines(const Real* first, int nodes, F&& visit) {
    constexpr int kLine = static_cast<int>(64 / sizeof(Real));
    for (int n = 0; n < nodes * kStride; n += kLine) visit(first + n);
    // Columns begin at pairs of nodes, which may be half a line.
    if (2 * kStride < kLine) visit(first + nodes * kStride - 1);
  }

  const PassArguments<P>& a_;
  int packs_;
  std::uint32_t ahead_;
  int next_ = 0;
};

}  // namespace breccia::grid

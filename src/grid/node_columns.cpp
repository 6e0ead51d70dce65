#include "grid/node_columns.hpp"

#include <algorithm>
#include <numeric>

#include "breccia/error.hpp"

namespace breccia::grid {
namespace {

// Whether two columns of a stencil lie a multiple of 4096 bytes apart: that makes loads wait for stores they have
// nothing to do with. Where velocities lie in two arrays of half the bytes, they then do not either.
bool collide(std::size_t height, std::size_t node_bytes) {
  constexpr std::size_t kPage = 4096;
  constexpr std::size_t kMostApart = 2 * kBlockWidth + 2;  // columns (0, 0) and (2, 2)
  for (std::size_t columns = 1; columns <= kMostApart; ++columns) {
    if (columns * height * node_bytes % kPage == 0) return true;
  }
  return false;
}

}  // namespace

std::uint32_t NodeColumns::height_of(std::size_t blocks) const {
  std::size_t height = blocks * kBlockWidth;
  if (collide(height, node_bytes_)) height += 2;
  return static_cast<std::uint32_t>(height);
}

BlockPlace NodeColumns::add_columns(std::size_t blocks) {
  const std::size_t end = end_ + std::size_t{kBlockWidth * kBlockWidth} * height_of(blocks);
  if (end + kBeyond > std::size_t{1} << 31) {
    throw NumericsError("more than 2^31 nodes of the grid on a rank: use more ranks, or a larger grid.cell");
  }
  const BlockPlace lowest{end_, height_of(blocks)};
  end_ = static_cast<std::uint32_t>(end);
  return lowest;
}

void NodeColumns::lay_out(std::span<const BlockKey> keys) {
  blocks_.assign(keys.size(), {});
  end_ = kBefore;
  in_order_.resize(keys.size());
  run_ends_.clear();
  std::iota(in_order_.begin(), in_order_.end(), 0U);
  std::ranges::sort(in_order_, {}, [&](std::uint32_t i) { return keys[i]; });
  for (std::size_t first = 0; first < keys.size();) {
    // z is in the lowest bits of a key.
    std::size_t last = first + 1;
    while (last < keys.size() && keys[in_order_[last]] == keys[in_order_[last - 1]] + 1) ++last;
    BlockPlace place = add_columns(last - first);
    for (; first < last; ++first, place.first += kBlockWidth) blocks_[in_order_[first]] = place;
    run_ends_.push_back(last);
  }
}

void NodeColumns::append_run(int count) {
  BlockPlace place = add_columns(static_cast<std::size_t>(count));
  for (int n = 0; n < count; ++n, place.first += kBlockWidth) blocks_.push_back(place);
}

}  // namespace breccia::grid

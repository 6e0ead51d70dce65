#include "grid/node_columns.hpp"

#include <algorithm>
#include <numeric>

namespace breccia::grid {

void NodeColumns::lay_out(std::span<const BlockKey> keys) {
  blocks_.assign(keys.size(), {});
  end_ = kBefore;
  std::vector<std::uint32_t> order(keys.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, {}, [&](std::uint32_t i) { return keys[i]; });
  for (std::size_t first = 0; first < order.size();) {
    // z is in the lowest bits of a key.
    std::size_t last = first + 1;
    while (last < order.size() && keys[order[last]] == keys[order[last - 1]] + 1) ++last;
    const auto height = height_of(static_cast<std::uint32_t>(last - first));
    for (std::size_t n = first; n < last; ++n) {
      blocks_[order[n]] = {end_ + static_cast<std::uint32_t>(n - first) * kBlockWidth, height};
    }
    end_ += kBlockWidth * kBlockWidth * height;
    first = last;
  }
}

void NodeColumns::append_run(int count) {
  const std::uint32_t height = height_of(static_cast<std::uint32_t>(count));
  for (std::uint32_t n = 0; n < static_cast<std::uint32_t>(count); ++n) blocks_.push_back({end_ + n * kBlockWidth, height});
  end_ += kBlockWidth * kBlockWidth * height;
}

}  // namespace breccia::grid

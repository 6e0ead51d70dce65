// Which blocks of space touch, of sorted lists of them.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "gravity/mesh/block_index.hpp"

namespace breccia::gravity {

/// f(i, j) for each of `blocks` and each of `others` that is the same or one of the 26 around it; both sorted. The
/// blocks around one are nine rows along z, and as the list is gone through, the places of those rows in the other only
/// move on: nothing is looked up.
template <class F>
void for_each_touching(std::span<const BlockIndex> blocks, std::span<const BlockIndex> others, const F& f) {
  std::array<std::size_t, 9> place{};
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const BlockIndex b = blocks[i];
    for (int row = 0; row < 9; ++row) {
      const BlockIndex first = block_around(b, 3 * row);
      const BlockIndex last = block_around(b, 3 * row + 2);
      std::size_t& from = place[static_cast<std::size_t>(row)];
      while (from < others.size() && others[from] < first) ++from;
      for (std::size_t j = from; j < others.size() && !(last < others[j]); ++j) f(i, j);
    }
  }
}

}  // namespace breccia::gravity

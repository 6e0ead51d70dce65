// Friends of friends among the particles of one rank.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "breccia/linalg.hpp"

namespace breccia::analysis {

/// Disjoint sets of 0 .. n-1.
class UnionFind {
 public:
  explicit UnionFind(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }

  /// The representative of i's set.
  std::size_t find(std::size_t i) {
    while (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];
      i = parent_[i];
    }
    return i;
  }
  /// Joins the two sets; the smaller representative stays, so the result does not depend on the order of calls.
  void unite(std::size_t i, std::size_t j) {
    i = find(i);
    j = find(j);
    parent_[i > j ? i : j] = i > j ? j : i;
  }

 private:
  std::vector<std::size_t> parent_;
};

/// Operations counted, so that tests can bound the work without a clock.
struct FriendsCost {
  std::uint64_t cell_pairs = 0;  ///< neighbouring cells looked at
  std::uint64_t distances = 0;   ///< between particles or boxes, and particles put into boxes
};

/// The sets of particles connected by steps shorter than `link` [m].
UnionFind link_friends(std::span<const Vec3d> position, double link, FriendsCost& cost);

}  // namespace breccia::analysis

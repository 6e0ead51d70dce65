// Slabs: the background grid cut between planes of nodes along one axis, each slab owned by one rank: its nodes, and
// the particles nearest to them. A cut may run through blocks. A rank may own nothing.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "mpi/comm.hpp"

namespace breccia::mpi {

/// Planes of nodes in a block.
inline constexpr std::int32_t kPlanesOfBlock = 4;
constexpr std::int32_t block_of_plane(std::int32_t plane) { return plane >> 2; }

/// Work counted along the axis of the slabs, in any unit. Integers: sums do not depend on their order. Slabs are cut
/// only before a plane of `nodes`: who counts whole blocks at the first plane of each keeps them whole.
struct PlaneWork {
  std::map<std::int32_t, std::uint64_t> nodes;   ///< plane of nodes -> work of the rank that owns it
  std::map<std::int32_t, std::uint64_t> blocks;  ///< plane of blocks -> work of every rank that owns a part of it

  friend bool operator==(const PlaneWork&, const PlaneWork&) = default;
};

/// The work of all ranks, on all ranks. Of a plane of blocks that several ranks have a part of, the largest part stands
/// for the whole: most blocks of it have matter on both sides of a cut. Collective.
PlaneWork sum_over_ranks(const PlaneWork& mine, const Comm& comm);

/// Work of all planes together, on one rank.
std::uint64_t total(const PlaneWork& work);

/// Planes of nodes that hold the middle nine tenths of the work: its extent without what flies far off; 0 without work.
std::int64_t extent(const PlaneWork& work);

class Slabs {
 public:
  /// One slab on one rank: owns every plane.
  Slabs() = default;
  /// Slabs as axis() and cuts() of others say.
  Slabs(int axis, std::vector<std::int32_t> cuts) : axis_(axis), cuts_(std::move(cuts)) {}
  /// Cuts so that the rank with the most of `all` has the least that whole planes allow; among such cuts,
  /// those nearest to even shares. Ranks may get nothing. A function of its arguments alone: all ranks find the same.
  static Slabs balanced(int axis, const PlaneWork& all, int ranks);

  [[nodiscard]] int axis() const { return axis_; }
  /// Rank that owns a plane of nodes.
  [[nodiscard]] int owner(std::int32_t plane) const;
  /// First plane of each rank but rank 0; not decreasing. Ranks between two equal cuts own nothing.
  [[nodiscard]] const std::vector<std::int32_t>& cuts() const { return cuts_; }
  /// True if cuts are at multiples of so many planes: no cut runs through a block, or through a stack of them.
  [[nodiscard]] bool keep_whole(std::int32_t planes) const;
  /// What each rank has of `all`.
  [[nodiscard]] std::vector<std::uint64_t> shares(const PlaneWork& all) const;

 private:
  int axis_ = 0;
  std::vector<std::int32_t> cuts_;
};

}  // namespace breccia::mpi

// Walls: planes that act on grid velocities, and periodic pairs of planes.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "breccia/scene.hpp"
#include "grid/blocks.hpp"

namespace breccia::grid {

class BoundarySet {
 public:
  BoundarySet(std::span<const BoundaryPlane> planes, double cell);

  /// Axes that repeat. Throws UsageError if a periodic pair is not a multiple of 4 cells apart.
  [[nodiscard]] const Periodicity& periodicity() const { return periodicity_; }
  /// True if there are planes other than periodic ones.
  [[nodiscard]] bool has_walls() const { return !walls_.empty(); }
  [[nodiscard]] std::span<const BoundaryPlane> walls() const { return walls_; }
  /// Finds the nodes of these blocks that lie in or behind a wall. `place(b, n)`: where v_new of node n of block b lies
  /// among the velocities [reals]; `shared(b)`: whether block b is updated before the rest.
  template <class Place, class Shared>
  void find_nodes(std::span<const BlockKey> blocks, Place&& place, Shared&& shared) {
    shared_nodes_.clear();
    rest_.clear();
    for (std::uint32_t b = 0; !walls_.empty() && b < blocks.size(); ++b) {
      for_each_node(blocks[b], [&](std::uint32_t node, std::uint32_t wall) {
        (shared(b) ? shared_nodes_ : rest_).push_back({place(b, node), wall});
      });
    }
  }
  /// Applies the walls to v^{n+1/2} of the found nodes.
  template <class Real>
  void apply_to_shared(Real* velocities) const {
    apply(shared_nodes_, velocities);
  }
  template <class Real>
  void apply_to_rest(Real* velocities) const {
    apply(rest_, velocities);
  }
  /// Whether a field repeats: it points along a periodic axis, and has no potential there.
  [[nodiscard]] bool repeats_along(Vec3d field) const;
  /// How far a particle at this node moves when sorting puts it back into the period: x before less x after [m].
  [[nodiscard]] Vec3d put_back(const std::int32_t (&node)[3]) const;
  /// The position moved into the period of the periodic axes.
  [[nodiscard]] Vec3d into_period(Vec3d x) const;
  /// Where the period of each axis starts, and its length; 0: it does not repeat [m].
  [[nodiscard]] Vec3d period_start() const { return period_start_; }
  [[nodiscard]] Vec3d period_length() const {
    const auto length = [&](std::size_t axis) { return periodicity_.blocks[axis] * kBlockWidth * cell_; };
    return {length(0), length(1), length(2)};
  }

 private:
  struct WallNode {
    std::size_t place;
    std::uint32_t wall;
  };
  void for_each_node(BlockKey block, const std::function<void(std::uint32_t, std::uint32_t)>& visit) const;
  template <class Real>
  void apply(std::span<const WallNode> nodes, Real* velocities) const;

  double cell_;
  std::vector<BoundaryPlane> walls_;
  std::vector<WallNode> shared_nodes_, rest_;
  Periodicity periodicity_;
  Vec3d period_start_{};
};

}  // namespace breccia::grid

#include "grid/boundary.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "breccia/error.hpp"
#include "grid/tile.hpp"
#include "grid/wall.hpp"

namespace breccia::grid {
namespace {

double& component(Vec3d& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
double component(const Vec3d& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

int axis_of(const Vec3d& normal) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(component(normal, axis)) > 1.0 - 1e-9) return axis;
  }
  return -1;
}

}  // namespace

BoundarySet::BoundarySet(std::span<const BoundaryPlane> planes, double cell) : cell_(cell) {
  std::vector<BoundaryPlane> periodic;
  for (const BoundaryPlane& plane : planes)
    (plane.kind == BoundaryKind::kPeriodic ? periodic : walls_).push_back(plane);
  for (const BoundaryPlane& low : periodic) {
    const int axis = axis_of(low.normal);
    if (axis < 0) throw UsageError("boundary: a periodic plane must be normal to a coordinate axis");
    if (component(low.normal, axis) < 0) continue;
    for (const BoundaryPlane& high : periodic) {
      if (axis_of(high.normal) != axis || component(high.normal, axis) > 0) continue;
      const double start = component(low.point, axis);
      const double cells = (component(high.point, axis) - start) / cell;
      const double blocks = std::round(cells / kBlockWidth);
      if (blocks < 1 || std::abs(cells - blocks * kBlockWidth) > 1e-6 * cells) {
        throw UsageError("boundary: periodic planes must be a multiple of 4 cells apart (" +
                         std::to_string(kBlockWidth * cell) + " m); here they are " + std::to_string(cells) +
                         " cells apart");
      }
      periodicity_.blocks[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(blocks);
      component(period_start_, axis) = start;
    }
  }
}

// Calls visit(node of the block, wall) for the nodes that lie in or behind a wall.
void BoundarySet::for_each_node(BlockKey key, const std::function<void(std::uint32_t, std::uint32_t)>& visit) const {
  const BlockCoord block = block_coord(key);
  for (std::uint32_t n = 0; n < kBlockNodes; ++n) {
    const auto node = static_cast<int>(n);
    const int i = kBlockWidth * block.x + node / 16;
    const int j = kBlockWidth * block.y + node / 4 % 4;
    const int k = kBlockWidth * block.z + node % 4;
    const Vec3d x = cell_ * Vec3d{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
    for (std::uint32_t w = 0; w < walls_.size(); ++w) {
      if (holds_node(walls_[w], x, cell_)) visit(n, w);
    }
  }
}

template <class Real>
void BoundarySet::apply(std::span<const WallNode> nodes, Real* velocities) const {
  for (const WallNode& at : nodes) {
    Real* v = velocities + at.place;
    const Vec3d allowed = constrained(walls_[at.wall], {v[0], v[1], v[2]});
    v[0] = static_cast<Real>(allowed.x);
    v[1] = static_cast<Real>(allowed.y);
    v[2] = static_cast<Real>(allowed.z);
  }
}

template void BoundarySet::apply(std::span<const WallNode>, float*) const;
template void BoundarySet::apply(std::span<const WallNode>, double*) const;

bool BoundarySet::repeats_along(Vec3d field) const {
  const Vec3d length = period_length();
  return field.x * length.x != 0.0 || field.y * length.y != 0.0 || field.z * length.z != 0.0;
}

Vec3d BoundarySet::put_back(const std::int32_t (&node)[3]) const {
  const auto moved = [&](int axis) {
    const std::int32_t block = node[axis] >> 2;
    return kBlockWidth * cell_ * (block - periodicity_.wrap(block, axis));
  };
  return {moved(0), moved(1), moved(2)};
}

Vec3d BoundarySet::into_period(Vec3d x) const {
  const Vec3d lengths = period_length();
  for (int axis = 0; axis < 3; ++axis) {
    const double length = component(std::as_const(lengths), axis);
    if (length == 0.0) continue;
    const double start = component(std::as_const(period_start_), axis);
    double& value = component(x, axis);
    value -= length * std::floor((value - start) / length);
  }
  return x;
}

}  // namespace breccia::grid

// Which cells the scale of a group is sampled from, on host and device (scales.hpp).
#pragma once

#include <cmath>

#include "gravity/tree/cell.hpp"

namespace breccia::gravity {

/// Particles of a group at which its field is sampled: one register of targets.
inline constexpr int kScaleSamples = 16;

/// Cells are opened where (b + R)/D exceeds this; three quarters of the fields then are right to a percent.
inline constexpr double kScaleOpening = 1.0;

/// Cells of this share of the mass tell how strong the field is at least.
inline constexpr double kHeavy = 1.0 / 16.0;
/// A cell whose field at its own radius is weaker by this factor than that is opened only from deep inside: around a
/// body, debris fills many wide cells of little mass.
inline constexpr double kFaint = 0.1;
inline constexpr double kDeepInside = 0.5;

/// The pull of a heavy cell from where the group is farthest.
BRECCIA_HD double least_pull(const Cell& heavy, const Cell& group) {
  const Vec3d d = group.centre - heavy.centre;
  const double farthest = std::sqrt(dot(d, d)) + heavy.radius + group.radius;
  return heavy.moments.mass / (farthest * farthest);
}

/// Whether a cell of the coarse tree in which the group does not lie is opened; `faint`: kFaint times the field.
BRECCIA_HD bool opened_for_scale(const Cell& cell, const Cell& group, double faint) {
  const Vec3d d = group.centre - cell.centre;
  const double d2 = dot(d, d);
  const double size = cell.radius + 0.5 * group.radius;
  const double deep = kDeepInside * cell.radius;
  const bool near = size * size >= kScaleOpening * kScaleOpening * d2;
  const bool strong = cell.moments.mass >= faint * (cell.radius * cell.radius) || d2 < deep * deep;
  return near && strong;
}

/// Whether `inner` is a part of `outer`, or it itself.
BRECCIA_HD bool contains(const Cell& outer, const Cell& inner) {
  return outer.end > outer.begin && outer.begin <= inner.begin && outer.end >= inner.end;
}

/// What the whole of another tree does to a cell; inside that tree it says nothing.
BRECCIA_HD double pull_of_whole(const Cell& whole, const Cell& cell) {
  const Vec3d d = cell.centre - whole.centre;
  const double farthest = std::sqrt(dot(d, d)) + cell.radius;
  return farthest > whole.radius ? whole.moments.mass / (farthest * farthest) : 0.0;
}

}  // namespace breccia::gravity

// Transfers with one node per register (or per two).
#pragma once

#include "grid/stencil.hpp"
#include "grid/transfer.hpp"
#include "grid/transpose.hpp"

namespace breccia::grid {

namespace detail {

/// sum w n and sum w (k - 1) n along x, y, z over the 27 nodes of one lane.
template <class P>
struct NodeSums {
  Node<P> value, x, y, z;
};

template <class P>
BRECCIA_HD NodeSums<P> gather_lane(const typename P::Real* nodes, const Stencil<P>& s, int lane) {
  using N = Node<P>;
  const typename P::Real* origin = nodes + s.start[lane] * kChannels;
  const N wx[3] = {N(s.weight[0][0][lane]), N(s.weight[0][1][lane]), N(s.weight[0][2][lane])};
  N plane[3], plane_x[3], plane_y[3];
  for (int k = 0; k < 3; ++k) {
    N line[3], line_x[3];
    for (int j = 0; j < 3; ++j) {
      const typename P::Real* row = origin + tile_index(0, j, k) * kChannels;
      const N first = wx[0] * N::load(row);
      const N last = wx[2] * N::load(row + 2 * kTilePlane * kChannels);
      const N wy(s.weight[1][j][lane]);
      line[j] = wy * (first + last + wx[1] * N::load(row + kTilePlane * kChannels));
      line_x[j] = wy * (last - first);
    }
    plane[k] = line[0] + line[1] + line[2];
    plane_y[k] = line[2] - line[0];
    plane_x[k] = line_x[0] + line_x[1] + line_x[2];
  }
  const N wz[3] = {N(s.weight_z[0][lane]), N(s.weight_z[1][lane]), N(s.weight_z[2][lane])};
  const N first = wz[0] * plane[0];
  const N last = wz[2] * plane[2];
  return {first + last + wz[1] * plane[1], wz[0] * plane_x[0] + wz[1] * plane_x[1] + wz[2] * plane_x[2],
          wz[0] * plane_y[0] + wz[1] * plane_y[1] + wz[2] * plane_y[2], last - first};
}

template <class P>
BRECCIA_HD void scatter_lane(typename P::Real* nodes, const Stencil<P>& s, int lane, const NodeSums<P>& q) {
  using N = Node<P>;
  typename P::Real* origin = nodes + s.start[lane] * kChannels;
  const N wx[3] = {N(s.weight[0][0][lane]), N(s.weight[0][1][lane]), N(s.weight[0][2][lane])};
  const N along_z[3] = {q.value - q.z, q.value, q.value + q.z};
  for (int k = 0; k < 3; ++k) {
    const N wz(s.weight_z[k][lane]);
    const N plane = wz * along_z[k];
    const N plane_x = wz * q.x;
    const N plane_y = wz * q.y;
    const N along_y[3] = {plane - plane_y, plane, plane + plane_y};
    for (int j = 0; j < 3; ++j) {
      const N wy(s.weight[1][j][lane]);
      const N line = wy * along_y[j];
      const N line_x = wy * plane_x;
      const N along_x[3] = {line - line_x, line, line + line_x};
      typename P::Real* row = origin + tile_index(0, j, k) * kChannels;
      for (int i = 0; i < 3; ++i) {
        typename P::Real* node = row + i * kTilePlane * kChannels;
        (N::load(node) + wx[i] * along_x[i]).store(node);
      }
    }
  }
}

}  // namespace detail

template <class P>
BRECCIA_HD void gather_nodes(const typename P::Real* nodes, const Stencil<P>& s, int lanes, GatheredVelocity<P>& g) {
  using T = typename P::RealPack;
  Node<P> value[P::kLanes];
  Node<P> xy[P::kLanes];
  Node<P> z[P::kLanes];
  for (int l = 0; l < lanes; ++l) {
    const detail::NodeSums<P> sums = detail::gather_lane<P>(nodes, s, l);
    value[l] = sums.value;
    xy[l] = join(lower(sums.x), lower(sums.y));
    z[l] = sums.z;
  }
  for (int l = lanes; l < P::kLanes; ++l) value[l] = xy[l] = z[l] = Node<P>{};
  T v[8];
  T gxy[8];
  T gz[8];
  rows_to_channels(value, v);
  rows_to_channels(xy, gxy);
  rows_to_channels(z, gz);
  g = {{v[0], v[1], v[2], v[3], v[4], v[5], v[6]},
       {gxy[0], gxy[1], gxy[2]},
       {gxy[4], gxy[5], gxy[6]},
       {gz[0], gz[1], gz[2]}};
}

template <class P>
BRECCIA_HD void scatter_nodes(typename P::Real* nodes, const Stencil<P>& s, int lanes, const SpreadMomentum<P>& q) {
  using T = typename P::RealPack;
  const T zero(typename P::Real(0));
  const T value[8] = {q.value[0], q.value[1], q.value[2], q.value[3], q.value[4], q.value[5], q.value[6], zero};
  const T x[8] = {q.by_x[0], q.by_x[1], q.by_x[2], q.by_x[3], q.by_x[4], q.by_x[5], zero, zero};
  const T y[8] = {q.by_y[0], q.by_y[1], q.by_y[2], q.by_y[3], q.by_y[4], q.by_y[5], zero, zero};
  const T z[8] = {q.by_z[0], q.by_z[1], q.by_z[2], q.by_z[3], q.by_z[4], q.by_z[5], zero, zero};
  Node<P> rows[4][P::kLanes];
  channels_to_rows(value, rows[0]);
  channels_to_rows(x, rows[1]);
  channels_to_rows(y, rows[2]);
  channels_to_rows(z, rows[3]);
  for (int l = 0; l < lanes; ++l) {
    detail::scatter_lane<P>(nodes, s, l, {rows[0][l], rows[1][l], rows[2][l], rows[3][l]});
  }
}

}  // namespace breccia::grid

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
  N value, x, y, first, last;
  for (int k = 0; k < 3; ++k) {
    N along_x[3], first_y, last_y;
    for (int i = 0; i < 3; ++i) {
      const auto node = [&](int j) BRECCIA_INLINE_LAMBDA { return N::load(origin + tile_index(i, j, k) * kChannels); };
      const N low = N(s.weight_xy[i][0][lane]) * node(0);
      const N high = N(s.weight_xy[i][2][lane]) * node(2);
      along_x[i] = (low + high) + N(s.weight_xy[i][1][lane]) * node(1);
      first_y = i == 0 ? low : first_y + low;
      last_y = i == 0 ? high : last_y + high;
    }
    const N wz(s.weight_z[k][lane]);
    const N plane = wz * ((along_x[0] + along_x[2]) + along_x[1]);
    if (k == 0) first = plane;
    if (k == 2) last = plane;
    value = k == 0 ? plane : value + plane;
    x = k == 0 ? wz * (along_x[2] - along_x[0]) : x + wz * (along_x[2] - along_x[0]);
    y = k == 0 ? wz * (last_y - first_y) : y + wz * (last_y - first_y);
  }
  return {value, x, y, last - first};
}

template <class P>
BRECCIA_HD void scatter_lane(typename P::Real* nodes, const Stencil<P>& s, int lane, const NodeSums<P>& q) {
  using N = Node<P>;
  typename P::Real* origin = nodes + s.start[lane] * kChannels;
  const N along_z[3] = {q.value - q.z, q.value, q.value + q.z};
  for (int k = 0; k < 3; ++k) {
    const N wz(s.weight_z[k][lane]);
    const N middle = wz * along_z[k];
    const N slope_x = wz * q.x;
    const N slope_y = wz * q.y;
    const N along_x[3] = {middle - slope_x, middle, middle + slope_x};
    for (int i = 0; i < 3; ++i) {
      const N along_y[3] = {along_x[i] - slope_y, along_x[i], along_x[i] + slope_y};
      for (int j = 0; j < 3; ++j) {
        typename P::Real* node = origin + tile_index(i, j, k) * kChannels;
        (N::load(node) + N(s.weight_xy[i][j][lane]) * along_y[j]).store(node);
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
  g = {{v[0], v[1], v[2]},
       {v[3], v[4], v[5]},
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

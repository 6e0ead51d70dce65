// Transfers with one node per register (or per two).
#pragma once

#include "grid/stencil.hpp"
#include "grid/tile_nodes.hpp"
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
BRECCIA_HD NodeSums<P> gather_lane(const TileNodes<P>& nodes, const Stencil<P>& s, int lane) {
  using N = Node<P>;
  const typename P::Real* const* const columns = nodes.velocities + s.column(lane);
  N plane[3], plane_x[3], plane_y[3];
  for (int k = 0; k < 3; ++k) {
    const auto first = static_cast<std::size_t>(s.along_z(lane) + k) * kChannels;
    N low[3], high[3], along_x[3];
    for (int i = 0; i < 3; ++i) {
      const auto term = [&](int j) BRECCIA_INLINE_LAMBDA {
        return N(s.weight_xy[i][j][lane]) * N::load(columns[column_index(i, j)] + first);
      };
      low[i] = term(0);
      high[i] = term(2);
      along_x[i] = (low[i] + high[i]) + term(1);
    }
    const N wz(s.weight_z[k][lane]);
    plane[k] = wz * ((along_x[0] + along_x[2]) + along_x[1]);
    plane_x[k] = wz * (along_x[2] - along_x[0]);
    plane_y[k] = wz * ((high[0] + high[1] + high[2]) - (low[0] + low[1] + low[2]));
  }
  return {(plane[0] + plane[2]) + plane[1], (plane_x[0] + plane_x[2]) + plane_x[1],
          (plane_y[0] + plane_y[2]) + plane_y[1], plane[2] - plane[0]};
}

/// Lanes `first` to `last` - 1, which have one stencil: its nodes are read and written once for all of them, as reading
/// what has just been written is slow. `rows`: value and slopes along x, y, z of each lane.
template <class P>
BRECCIA_HD void scatter_run(const TileNodes<P>& nodes, const Stencil<P>& s, int first, int last,
                            const Node<P> (&rows)[4][P::kLanes]) {
  using N = Node<P>;
  for (int k = 0; k < 3; ++k) {
    typename P::Real* const* const columns = nodes.sums + s.column(first);
    const auto at = static_cast<std::size_t>(s.along_z(first) + k) * kChannels;
    N sum[3][3];
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) sum[i][j] = N::load(columns[column_index(i, j)] + at);
    }
    for (int l = first; l < last; ++l) {
      const N wz(s.weight_z[k][l]);
      const N middle = wz * (rows[0][l] + N(typename P::Real(k - 1)) * rows[3][l]);
      const N slope_x = wz * rows[1][l];
      const N slope_y = wz * rows[2][l];
      const N along_x[3] = {middle - slope_x, middle, middle + slope_x};
      for (int i = 0; i < 3; ++i) {
        sum[i][0] += N(s.weight_xy[i][0][l]) * (along_x[i] - slope_y);
        sum[i][1] += N(s.weight_xy[i][1][l]) * along_x[i];
        sum[i][2] += N(s.weight_xy[i][2][l]) * (along_x[i] + slope_y);
      }
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) sum[i][j].store(columns[column_index(i, j)] + at);
    }
  }
}

}  // namespace detail

template <class P>
BRECCIA_HD void gather_nodes(const TileNodes<P>& nodes, const Stencil<P>& s, int lanes, GatheredVelocity<P>& g) {
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
BRECCIA_HD void scatter_nodes(const TileNodes<P>& nodes, const Stencil<P>& s, int lanes, const SpreadMomentum<P>& q) {
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
  if (mostly_shared(s, lanes)) {
    for (int first = 0, last = 0; first < lanes; first = last) {
      while (last < lanes && s.start[last] == s.start[first]) ++last;
      detail::scatter_run<P>(nodes, s, first, last, rows);
    }
  } else {
    for (int l = 0; l < lanes; ++l) detail::scatter_run<P>(nodes, s, l, l + 1, rows);
  }
}

}  // namespace breccia::grid

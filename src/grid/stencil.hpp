// Quadratic B-spline weights of a pack of particles and the two transfers of one lane, with node channels in lanes.
// Separable: a gather contracts z, y, x; a scatter expands x, y, z (cpu_limit.md 2).
#pragma once

#include "grid/tile.hpp"

namespace breccia::grid {

/// Offset from the nearest node in cells, in [-1/2, 1/2).
BRECCIA_HD Pack<float, 16> offset_in_cells(Pack<std::int32_t, 16> offset) {
  return convert<float>(offset) * Pack<float, 16>(0x1p-32F);
}
BRECCIA_HD Pack<double, 8> offset_in_cells(Pack<double, 8> offset) { return offset; }

/// Coordinate of the nearest node along an axis, 0 .. 5 inside the margin: the first node of the stencil in the tile.
template <int W>
BRECCIA_HD Pack<std::int32_t, W> stencil_start(Pack<std::int32_t, W> node, int axis) {
  using I = Pack<std::int32_t, W>;
  return ((node >> (8 * axis)) & I(255)) - I(kNodeBias - 1);
}

/// Weights w_k and first moments w_k r_k, r_k = (x_node - x_p)/dx, of three nodes along three axes.
template <class P>
struct Stencil {
  using Real = typename P::Real;
  alignas(64) Real weight[3][3][P::kLanes];
  alignas(64) Real moment[3][3][P::kLanes];
  alignas(64) std::int32_t start[P::kLanes];  ///< index of the first node in the tile

  /// Sets the stencil of all lanes; returns the mask of lanes outside the margin, whose start is made harmless.
  BRECCIA_HD typename P::IntPack::Mask set(const Kinematics<P>& k) {
    using T = typename P::RealPack;
    using I = typename P::IntPack;
    const T half(Real(0.5));
    const T one(Real(1));
    for (int axis = 0; axis < 3; ++axis) {
      const T d = offset_in_cells(k.offset[axis]);
      const T lower = half - d;
      const T upper = half + d;
      const T w[3] = {half * lower * lower, T(Real(0.75)) - d * d, half * upper * upper};
      const T r[3] = {-one - d, -d, one - d};
      for (int i = 0; i < 3; ++i) {
        w[i].store(weight[axis][i]);
        (w[i] * r[i]).store(moment[axis][i]);
      }
    }
    const I x = stencil_start(k.node, 0);
    const I y = stencil_start(k.node, 1);
    const I z = stencil_start(k.node, 2);
    const I low = min(min(x, y), z);
    const I high = max(max(x, y), z);
    const auto outside = (low < I(0)) | (high > I(kTileWidth - 3));
    const I index = (x * I(kTileWidth) + y) * I(kTileWidth) + z;
    select(outside, I(0), index).store(start);
    return outside;
  }
};

/// sum w n and sum w r n along x, y, z over the 27 nodes of one lane.
template <class P>
struct Gathered {
  Node<P> value, x, y, z;
};

template <class P>
BRECCIA_HD Gathered<P> gather_lane(const typename P::Real* nodes, const Stencil<P>& s, int lane) {
  using N = Node<P>;
  const typename P::Real* origin = nodes + s.start[lane] * kChannels;
  const N wz[3] = {N(s.weight[2][0][lane]), N(s.weight[2][1][lane]), N(s.weight[2][2][lane])};
  const N mz[3] = {N(s.moment[2][0][lane]), N(s.moment[2][1][lane]), N(s.moment[2][2][lane])};
  Gathered<P> g{N{}, N{}, N{}, N{}};
  for (int i = 0; i < 3; ++i) {
    N plane{}, plane_y{}, plane_z{};
    for (int j = 0; j < 3; ++j) {
      const typename P::Real* row = origin + (i * kTileWidth + j) * kTileWidth * kChannels;
      const N n0 = N::load(row);
      const N n1 = N::load(row + kChannels);
      const N n2 = N::load(row + 2 * kChannels);
      const N line = wz[0] * n0 + wz[1] * n1 + wz[2] * n2;
      const N line_z = mz[0] * n0 + mz[1] * n1 + mz[2] * n2;
      const N wy(s.weight[1][j][lane]);
      plane += wy * line;
      plane_y += N(s.moment[1][j][lane]) * line;
      plane_z += wy * line_z;
    }
    const N wx(s.weight[0][i][lane]);
    g.value += wx * plane;
    g.x += N(s.moment[0][i][lane]) * plane;
    g.y += wx * plane_y;
    g.z += wx * plane_z;
  }
  return g;
}

/// Adds w (value + x r_x + y r_y + z r_z) to the 27 nodes of one lane.
template <class P>
BRECCIA_HD void scatter_lane(typename P::Real* nodes, const Stencil<P>& s, int lane, const Gathered<P>& q) {
  using N = Node<P>;
  typename P::Real* origin = nodes + s.start[lane] * kChannels;
  const N wz[3] = {N(s.weight[2][0][lane]), N(s.weight[2][1][lane]), N(s.weight[2][2][lane])};
  const N mz[3] = {N(s.moment[2][0][lane]), N(s.moment[2][1][lane]), N(s.moment[2][2][lane])};
  for (int i = 0; i < 3; ++i) {
    const N wx(s.weight[0][i][lane]);
    const N plane = wx * q.value + N(s.moment[0][i][lane]) * q.x;
    const N plane_y = wx * q.y;
    const N plane_z = wx * q.z;
    for (int j = 0; j < 3; ++j) {
      const N wy(s.weight[1][j][lane]);
      const N line = wy * plane + N(s.moment[1][j][lane]) * plane_y;
      const N line_z = wy * plane_z;
      typename P::Real* row = origin + (i * kTileWidth + j) * kTileWidth * kChannels;
      for (int k = 0; k < 3; ++k) {
        typename P::Real* node = row + k * kChannels;
        (N::load(node) + (wz[k] * line + mz[k] * line_z)).store(node);
      }
    }
  }
}

}  // namespace breccia::grid

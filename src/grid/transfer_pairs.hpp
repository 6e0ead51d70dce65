// Transfers with two nodes per register: along z the stencil starts at an even node, so that every pair is one aligned
// cache line; a fourth node has weight 0.
#pragma once

#include "grid/stencil.hpp"
#include "grid/transfer.hpp"
#include "grid/transpose.hpp"

namespace breccia::grid {

namespace detail {

template <class P>
using NodePair = Pack<typename P::Real, 2 * kChannels>;

/// The same pointer, as one register: else the compiler keeps base and index apart and spends an instruction on every
/// node to add them.
template <class T>
BRECCIA_HD T* in_one_register(T* pointer) {
  asm("" : "+r"(pointer));
  return pointer;
}

/// Weights of the two pairs along z, and those along x and y, of one lane.
template <class P>
struct PairWeights {
  using Real = typename P::Real;
  using N = NodePair<P>;
  N wx[3], wy[3], wz[2], mz[2];

  BRECCIA_HD PairWeights(const Stencil<P>& s, int lane) {
    for (int i = 0; i < 3; ++i) {
      wx[i] = N(s.weight[0][i][lane]);
      wy[i] = N(s.weight[1][i][lane]);
    }
    for (int p = 0; p < 2; ++p) {
      wz[p] = halves<Real, N::kLanes>(s.weight_z[2 * p][lane], s.weight_z[2 * p + 1][lane]);
      mz[p] = halves<Real, N::kLanes>(s.moment_z[2 * p][lane], s.moment_z[2 * p + 1][lane]);
    }
  }
};

/// One particle's row: the seven values, then the slopes of v_new: z_0, x, y, z_1, z_2 (from the sums over both nodes
/// of the pairs).
template <class P>
BRECCIA_HD NodePair<P> gather_row(const typename P::Real* nodes, const Stencil<P>& s, int lane) {
  using N = NodePair<P>;
  const auto* origin = in_one_register(nodes + s.start[lane] * kChannels);
  const PairWeights<P> w(s, lane);
  N plane[2], plane_x[2], plane_y[2];
  for (int p = 0; p < 2; ++p) {
    N line[3], line_x[3];
    for (int j = 0; j < 3; ++j) {
      const typename P::Real* row = origin + tile_index(0, j, 2 * p) * kChannels;
      const N below = w.wx[0] * N::load(row);
      const N above = w.wx[2] * N::load(row + 2 * kTilePlane * kChannels);
      line[j] = (below + above) + w.wx[1] * N::load(row + kTilePlane * kChannels);
      line_x[j] = above - below;
    }
    const N below = w.wy[0] * line[0];
    const N above = w.wy[2] * line[2];
    plane[p] = (below + above) + w.wy[1] * line[1];
    plane_y[p] = above - below;
    plane_x[p] = w.wy[0] * line_x[0] + w.wy[1] * line_x[1] + w.wy[2] * line_x[2];
  }
  const N value = w.wz[0] * plane[0] + w.wz[1] * plane[1];
  const N x = w.wz[0] * plane_x[0] + w.wz[1] * plane_x[1];
  const N y = w.wz[0] * plane_y[0] + w.wz[1] * plane_y[1];
  const N z = w.mz[0] * plane[0] + w.mz[1] * plane[1];
  const N value_z = joined_halves(value, z);
  const N xy = joined_halves(x, y);
  return N(__builtin_shufflevector(value_z.v, xy.v, 0, 1, 2, 3, 4, 5, 6, 8, 16, 17, 18, 24, 25, 26, 9, 10));
}

template <class P>
BRECCIA_HD void scatter_row(typename P::Real* nodes, const Stencil<P>& s, int lane, const typename P::Real* value_x,
                            const typename P::Real* y_z) {
  using N = NodePair<P>;
  auto* origin = in_one_register(nodes + s.start[lane] * kChannels);
  const PairWeights<P> w(s, lane);
  const N value = load_twice<typename P::Real, N::kLanes>(value_x);
  const N x = load_twice<typename P::Real, N::kLanes>(value_x + kChannels);
  const N y = load_twice<typename P::Real, N::kLanes>(y_z);
  const N z = load_twice<typename P::Real, N::kLanes>(y_z + kChannels);
  for (int p = 0; p < 2; ++p) {
    const N plane = w.wz[p] * value + w.mz[p] * z;
    const N plane_x = w.wz[p] * x;
    const N plane_y = w.wz[p] * y;
    const N along_y[3] = {plane - plane_y, plane, plane + plane_y};
    for (int j = 0; j < 3; ++j) {
      const N line = w.wy[j] * along_y[j];
      const N line_x = w.wy[j] * plane_x;
      const N along_x[3] = {line - line_x, line, line + line_x};
      typename P::Real* row = origin + tile_index(0, j, 2 * p) * kChannels;
      for (int i = 0; i < 3; ++i) {
        typename P::Real* pair = row + i * kTilePlane * kChannels;
        (N::load(pair) + w.wx[i] * along_x[i]).store(pair);
      }
    }
  }
}

}  // namespace detail

template <class P>
BRECCIA_HD void gather_pairs(const typename P::Real* nodes, const Stencil<P>& s, int lanes, GatheredVelocity<P>& g) {
  static_assert(P::kLanes == 2 * kChannels);
  detail::NodePair<P> row[P::kLanes];
  for (int l = 0; l < lanes; ++l) row[l] = detail::gather_row<P>(nodes, s, l);
  for (int l = lanes; l < P::kLanes; ++l) row[l] = detail::NodePair<P>(typename P::Real(0));
  transpose16(row);
  g = {{row[0], row[1], row[2], row[3], row[4], row[5], row[6]},
       {row[8], row[9], row[10]},
       {row[11], row[12], row[13]},
       {row[7], row[14], row[15]}};
}

template <class P>
BRECCIA_HD void scatter_pairs(typename P::Real* nodes, const Stencil<P>& s, int lanes, const SpreadMomentum<P>& q) {
  using Real = typename P::Real;
  using T = typename P::RealPack;
  const T zero(Real(0));
  // Assigned one by one: of a list the compiler makes a copy in memory, with a slow string instruction.
  T value_x[16], y_z[16];
  for (int c = 0; c < 7; ++c) value_x[c] = q.value[c];
  for (int c = 0; c < 6; ++c) {
    value_x[8 + c] = q.by_x[c];
    y_z[c] = q.by_y[c];
    y_z[8 + c] = q.by_z[c];
  }
  value_x[7] = value_x[14] = value_x[15] = zero;
  y_z[6] = y_z[7] = y_z[14] = y_z[15] = zero;
  transpose16(value_x);
  transpose16(y_z);
  alignas(64) Real row[2][16][16];
  for (int l = 0; l < 16; ++l) {
    value_x[l].store(row[0][l]);
    y_z[l].store(row[1][l]);
  }
  // Neighbours in the pack often lie in one cell: taking them in turns with those of the other half lets the stores of
  // one finish before the next reads the same nodes.
  constexpr int kHalf = P::kLanes / 2;
  for (int l = 0; l < kHalf && l < lanes; ++l) {
    detail::scatter_row<P>(nodes, s, l, row[0][l], row[1][l]);
    if (l + kHalf < lanes) detail::scatter_row<P>(nodes, s, l + kHalf, row[0][l + kHalf], row[1][l + kHalf]);
  }
}

}  // namespace breccia::grid

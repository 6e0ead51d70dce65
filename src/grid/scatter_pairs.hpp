// Scatter with two nodes per register: along z the stencil starts at an even node, so that every pair is one aligned
// cache line; a fourth node has weight 0.
#pragma once

#include "grid/stencil.hpp"
#include "grid/tile_nodes.hpp"
#include "grid/transfer.hpp"
#include "grid/transpose.hpp"

namespace breccia::grid {

namespace detail {

/// What particles of one stencil add to its nodes, in registers: memory that has just been written is slow to read.
template <class P>
class StencilSums {
  using N = TwoNodes<P>;
  using Real = typename P::Real;

 public:
  BRECCIA_HD StencilSums(const TileNodes<P>& nodes, const Stencil<P>& s, int lane) { load(nodes, s, lane); }
  BRECCIA_HD void load(const TileNodes<P>& nodes, const Stencil<P>& s, int lane) {
    columns_ = nodes.sums + s.column(lane);
    first_ = static_cast<std::size_t>(s.along_z(lane)) * kChannels;
    for (int p = 0; p < 2; ++p) {
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) sum_[p][i][j] = N::load(node(p, i, j));
      }
    }
  }
  BRECCIA_HD void store() const {
    for (int p = 0; p < 2; ++p) {
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) sum_[p][i][j].store(node(p, i, j));
      }
    }
  }
  BRECCIA_HD void add(const Stencil<P>& s, int lane, const Real* value_x, const Real* y_z) {
    const N value = load_twice<Real, N::kLanes>(value_x);
    const N x = load_twice<Real, N::kLanes>(value_x + kChannels);
    const N y = load_twice<Real, N::kLanes>(y_z);
    const N z = load_twice<Real, N::kLanes>(y_z + kChannels);
    for (int p = 0; p < 2; ++p) {
      const N wz = halves<Real, N::kLanes>(s.weight_z[2 * p][lane], s.weight_z[2 * p + 1][lane]);
      const N mz = halves<Real, N::kLanes>(s.moment_z[2 * p][lane], s.moment_z[2 * p + 1][lane]);
      const N middle = wz * value + mz * z;
      const N slope_x = wz * x;
      const N slope_y = wz * y;
      const N along_x[3] = {middle - slope_x, middle, middle + slope_x};
      for (int i = 0; i < 3; ++i) {
        sum_[p][i][0] += N(s.weight_xy[i][0][lane]) * (along_x[i] - slope_y);
        sum_[p][i][1] += N(s.weight_xy[i][1][lane]) * along_x[i];
        sum_[p][i][2] += N(s.weight_xy[i][2][lane]) * (along_x[i] + slope_y);
      }
    }
  }

 private:
  BRECCIA_HD Real* node(int p, int i, int j) const { return columns_[column_index(i, j)] + first_ + 2 * p * kChannels; }

  Real* const* columns_;
  std::size_t first_;
  N sum_[2][3][3];
};

}  // namespace detail

template <class P>
BRECCIA_HD void scatter_pairs(const TileNodes<P>& nodes, const Stencil<P>& s, int lanes, const SpreadMomentum<P>& q) {
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
  detail::StencilSums<P> sums(nodes, s, 0);
  for (int l = 0;;) {
    sums.add(s, l, row[0][l], row[1][l]);
    if (++l == lanes) break;
    if (s.start[l] == s.start[l - 1]) continue;
    sums.store();
    sums.load(nodes, s, l);
  }
  sums.store();
}

}  // namespace breccia::grid

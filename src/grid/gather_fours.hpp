// Gather with four nodes per register, four channels each: the velocities of the nodes lie in two arrays for it, so
// that the three nodes of a stencil along z are one load of either (node_velocities.hpp). Nothing but the weights is
// the particle's own until the sums over x and y are done.
#pragma once

#include "grid/stencil.hpp"
#include "grid/tile_nodes.hpp"
#include "grid/transfer.hpp"
#include "grid/transpose.hpp"

namespace breccia::grid {

namespace detail {

/// The nodes of a stencil in memory: of each column four nodes along z, one more than the stencil has, four channels of
/// v_new (with x of v_old) and the rest of v_old.
template <class P>
class NodesInMemory {
  using N = FourNodes<P>;

 public:
  BRECCIA_HD NodesInMemory(const TileNodes<P>& nodes, const Stencil<P>& s, int lane)
      : columns_(nodes.velocities + s.column(lane)),
        moving_(static_cast<std::size_t>(s.along_z(lane)) * kVelocityChannels),
        rest_(moving_ + nodes.rest) {}
  BRECCIA_HD N moving(int i, int j) const { return N::load(columns_[column_index(i, j)] + moving_); }
  BRECCIA_HD N rest(int i, int j) const { return N::load(columns_[column_index(i, j)] + rest_); }

 private:
  const typename P::Real* const* columns_;
  std::size_t moving_, rest_;
};

/// The same in registers, for several particles of one stencil.
template <class P>
class NodesInRegisters {
  using N = FourNodes<P>;

 public:
  BRECCIA_HD explicit NodesInRegisters(const NodesInMemory<P>& nodes) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        moving_[i][j] = nodes.moving(i, j);
        rest_[i][j] = nodes.rest(i, j);
      }
    }
  }
  BRECCIA_HD N moving(int i, int j) const { return moving_[i][j]; }
  BRECCIA_HD N rest(int i, int j) const { return rest_[i][j]; }

 private:
  N moving_[3][3], rest_[3][3];
};

/// Sums over the nine columns of a stencil: four nodes along z, four channels each.
template <class N>
struct ColumnSums {
  N value, x, y;  ///< sum w n, and sum w (k - 1) n along x and y
};

template <class P, class Nodes>
BRECCIA_HD ColumnSums<FourNodes<P>> sum_moving(const Nodes& nodes, const Stencil<P>& s, int lane) {
  using N = FourNodes<P>;
  const auto weight = [&](int i, int j) BRECCIA_INLINE_LAMBDA { return N(s.weight_xy[i][j][lane]); };
  N low[3], high[3], along_x[3];
  for (int i = 0; i < 3; ++i) {
    low[i] = weight(i, 0) * nodes.moving(i, 0);
    high[i] = weight(i, 2) * nodes.moving(i, 2);
    along_x[i] = (low[i] + high[i]) + weight(i, 1) * nodes.moving(i, 1);
  }
  return {(along_x[0] + along_x[2]) + along_x[1], along_x[2] - along_x[0],
          (high[0] + high[1] + high[2]) - (low[0] + low[1] + low[2])};
}

template <class P, class Nodes>
BRECCIA_HD FourNodes<P> sum_rest(const Nodes& nodes, const Stencil<P>& s, int lane) {
  using N = FourNodes<P>;
  N along_x[3];
  for (int i = 0; i < 3; ++i) {
    const auto term = [&](int j) BRECCIA_INLINE_LAMBDA { return N(s.weight_xy[i][j][lane]) * nodes.rest(i, j); };
    along_x[i] = (term(0) + term(1)) + term(2);
  }
  return (along_x[0] + along_x[2]) + along_x[1];
}

/// Quarters of two registers, one after the other.
template <int a, int b, int c, int d, class N>
BRECCIA_HD N quarters(N first, N second) {
  constexpr int kA = 4 * a, kB = 4 * b, kC = 16 + 4 * c, kD = 16 + 4 * d;
  return N(__builtin_shufflevector(first.v, second.v, kA, kA + 1, kA + 2, kA + 3, kB, kB + 1, kB + 2, kB + 3, kC,
                                   kC + 1, kC + 2, kC + 3, kD, kD + 1, kD + 2, kD + 3));
}

/// One particle's row, by quarters: v_new and x of v_old; its slope along z; along x and y of v_old; along y and z of
/// v_old.
template <class P, class Nodes>
BRECCIA_HD FourNodes<P> gather_row(const Nodes& nodes, const Stencil<P>& s, int lane) {
  using N = FourNodes<P>;
  using Real = typename P::Real;
  const ColumnSums<N> sums = sum_moving<P>(nodes, s, lane);
  const N rest = sum_rest<P>(nodes, s, lane);
  // Slopes of the fourth channel nobody needs: the rest of v_old takes their place (RestChannel).
  constexpr int kY = 16 + kRestOldY, kZ = 16 + kRestOldZ;
  const N x(
      __builtin_shufflevector(sums.x.v, rest.v, 0, 1, 2, kY, 4, 5, 6, kY + 4, 8, 9, 10, kY + 8, 12, 13, 14, kY + 12));
  const N y(
      __builtin_shufflevector(sums.y.v, rest.v, 0, 1, 2, kZ, 4, 5, 6, kZ + 4, 8, 9, 10, kZ + 8, 12, 13, 14, kZ + 12));
  const N low = quarters<0, 1, 0, 1>(x, y);
  const N high = quarters<2, 3, 2, 3>(x, y);
  alignas(64) static constexpr Real kFirst[16] = {1, 1, 1, 1, -1, -1, -1, -1, 1, 1, 1, 1, 1, 1, 1, 1};
  alignas(64) static constexpr Real kMiddle[16] = {1, 1, 1, 1, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};
  const N first = N(s.weight_z[0][lane]) * N::load(kFirst);
  const N middle = N(s.weight_z[1][lane]) * N::load(kMiddle);
  return first * quarters<0, 0, 0, 2>(sums.value, low) + middle * quarters<1, 1, 1, 3>(sums.value, low) +
         N(s.weight_z[2][lane]) * quarters<2, 2, 0, 2>(sums.value, high);
}

template <class P>
BRECCIA_HD void gather_each(const TileNodes<P>& nodes, const Stencil<P>& s, int lanes, FourNodes<P>* row) {
  for (int l = 0; l < lanes; ++l) row[l] = gather_row<P>(NodesInMemory<P>(nodes, s, l), s, l);
}

/// The same where neighbours mostly share their stencil: its nodes are read once for all of them.
template <class P>
BRECCIA_HD void gather_runs(const TileNodes<P>& nodes, const Stencil<P>& s, int lanes, FourNodes<P>* row) {
  NodesInRegisters<P> here(NodesInMemory<P>(nodes, s, 0));
  for (int l = 0;;) {
    row[l] = gather_row<P>(here, s, l);
    if (++l == lanes) return;
    if (s.start[l] != s.start[l - 1]) here = NodesInRegisters<P>(NodesInMemory<P>(nodes, s, l));
  }
}

}  // namespace detail

template <class P>
BRECCIA_HD void gather_fours(const TileNodes<P>& nodes, const Stencil<P>& s, int lanes, GatheredVelocity<P>& g) {
  static_assert(P::kLanes == 4 * kVelocityChannels);
  FourNodes<P> row[P::kLanes];
  if (mostly_shared(s, lanes)) {
    detail::gather_runs<P>(nodes, s, lanes, row);
  } else {
    detail::gather_each<P>(nodes, s, lanes, row);
  }
  for (int l = lanes; l < P::kLanes; ++l) row[l] = FourNodes<P>(typename P::Real(0));
  transpose16(row);
  g = {{row[0], row[1], row[2]},
       {row[3], row[11], row[15]},
       {row[8], row[9], row[10]},
       {row[12], row[13], row[14]},
       {row[4], row[5], row[6]}};
}

}  // namespace breccia::grid

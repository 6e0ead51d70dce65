// Scatter with two nodes per register: along z the stencil starts at an even node, so that every pair is one aligned
// cache line; a fourth node has weight 0.
#pragma once

#include <type_traits>
#include <utility>

#include "grid/stencil.hpp"
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
  BRECCIA_HD explicit StencilSums(Real* origin) { load(origin); }
  BRECCIA_HD void load(Real* origin) {
    origin_ = in_one_register(origin);
    for_each([&](auto p, auto i, auto j) BRECCIA_INLINE_LAMBDA { at(p, i, j) = N::load(node(p, i, j)); });
  }
  BRECCIA_HD void store() const {
    for_each([&](auto p, auto i, auto j) BRECCIA_INLINE_LAMBDA { at(p, i, j).store(node(p, i, j)); });
  }
  BRECCIA_HD void add(const Stencil<P>& s, int lane, const Real* value_x, const Real* y_z) {
    const N value = load_twice<Real, N::kLanes>(value_x);
    const N x = load_twice<Real, N::kLanes>(value_x + kChannels);
    const N y = load_twice<Real, N::kLanes>(y_z);
    const N z = load_twice<Real, N::kLanes>(y_z + kChannels);
    add_pair<0>(s, lane, value, x, y, z);
    add_pair<1>(s, lane, value, x, y, z);
  }

 private:
  template <int p>
  BRECCIA_HD void add_pair(const Stencil<P>& s, int lane, N value, N x, N y, N z) {
    const N wz = halves<Real, N::kLanes>(s.weight_z[2 * p][lane], s.weight_z[2 * p + 1][lane]);
    const N mz = halves<Real, N::kLanes>(s.moment_z[2 * p][lane], s.moment_z[2 * p + 1][lane]);
    const N middle = wz * value + mz * z;
    const N slope_x = wz * x;
    const N slope_y = wz * y;
    add_plane<p, 0>(s, lane, middle - slope_x, slope_y);
    add_plane<p, 1>(s, lane, middle, slope_y);
    add_plane<p, 2>(s, lane, middle + slope_x, slope_y);
  }
  template <int p, int i>
  BRECCIA_HD void add_plane(const Stencil<P>& s, int lane, N middle, N slope) {
    sum_[9 * p + 3 * i] += N(s.weight_xy[i][0][lane]) * (middle - slope);
    sum_[9 * p + 3 * i + 1] += N(s.weight_xy[i][1][lane]) * middle;
    sum_[9 * p + 3 * i + 2] += N(s.weight_xy[i][2][lane]) * (middle + slope);
  }
  template <class F, int... n>
  BRECCIA_HD static void for_each(F&& f, std::integer_sequence<int, n...>) {
    (f(std::integral_constant<int, n / 9>(), std::integral_constant<int, n / 3 % 3>(),
       std::integral_constant<int, n % 3>()),
     ...);
  }
  template <class F>
  BRECCIA_HD static void for_each(F&& f) {
    for_each(f, std::make_integer_sequence<int, 18>());
  }
  template <class A, class B, class C>
  BRECCIA_HD N& at(A, B, C) {
    return sum_[9 * A::value + 3 * B::value + C::value];
  }
  template <class A, class B, class C>
  BRECCIA_HD const N& at(A, B, C) const {
    return sum_[9 * A::value + 3 * B::value + C::value];
  }
  template <class A, class B, class C>
  BRECCIA_HD Real* node(A, B, C) const {
    return origin_ + tile_index(B::value, C::value, 2 * A::value) * kChannels;
  }

  Real* origin_;
  N sum_[18];
};

}  // namespace detail

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
  detail::StencilSums<P> sums(nodes + s.start[0] * kChannels);
  for (int l = 0;;) {
    sums.add(s, l, row[0][l], row[1][l]);
    if (++l == lanes) break;
    if (s.start[l] == s.start[l - 1]) continue;
    sums.store();
    sums.load(nodes + s.start[l] * kChannels);
  }
  sums.store();
}

}  // namespace breccia::grid

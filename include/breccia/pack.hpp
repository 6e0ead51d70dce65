// SIMD packs: W lanes of a scalar S with the operators of a number, so that one physics source serves scalars, packs
// and CUDA threads. Host only (g++ and clang vector extensions); the layout is the same on every instruction set.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "breccia/macros.hpp"

namespace breccia {

namespace detail {
// The attribute is silently lost on a dependent typedef inside a class, hence this helper.
template <class S, int W>
struct VectorOf {
  static constexpr int kBytes = static_cast<int>(sizeof(S)) * W;
  using type [[gnu::vector_size(kBytes)]] = S;
};
template <class S>
struct IntOfSize;
template <>
struct IntOfSize<float> {
  using type = std::int32_t;
};
template <>
struct IntOfSize<double> {
  using type = std::int64_t;
};
template <>
struct IntOfSize<std::int32_t> {
  using type = std::int32_t;
};
template <>
struct IntOfSize<std::int64_t> {
  using type = std::int64_t;
};
template <>
struct IntOfSize<std::uint32_t> {
  using type = std::int32_t;
};
}  // namespace detail

/// Lane mask of a pack: all bits set where true.
template <class I, int W>
struct PackMask {
  using Vector = typename detail::VectorOf<I, W>::type;
  Vector v;
};

/// W lanes of S. Arithmetic is lane-wise; a scalar operand is broadcast. The alignment is stated because that of a wide
/// vector depends on the instruction set, and packs in memory are shared by all copies of the kernels.
template <class S, int W>
struct alignas(sizeof(S) * W) Pack {
  using Scalar = S;
  using Vector = typename detail::VectorOf<S, W>::type;
  using MaskInt = typename detail::IntOfSize<S>::type;
  using Mask = PackMask<MaskInt, W>;
  static constexpr int kLanes = W;

  Vector v;

  Pack() = default;
  BRECCIA_HD Pack(Vector x) : v(x) {}
  // s - 0 is s for every s, -0 included: the compiler makes it a plain broadcast.
  BRECCIA_HD Pack(S s) : v(s - Vector{}) {}

  BRECCIA_HD static Pack load(const S* p) {
    Pack r;
    std::memcpy(&r.v, p, sizeof(Vector));
    return r;
  }
  BRECCIA_HD void store(S* p) const { std::memcpy(p, &v, sizeof(Vector)); }
  BRECCIA_HD S operator[](int lane) const { return v[lane]; }
  BRECCIA_HD void set(int lane, S s) { v[lane] = s; }

  friend BRECCIA_HD Pack operator+(Pack a, Pack b) { return a.v + b.v; }
  friend BRECCIA_HD Pack operator-(Pack a, Pack b) { return a.v - b.v; }
  friend BRECCIA_HD Pack operator*(Pack a, Pack b) { return a.v * b.v; }
  friend BRECCIA_HD Pack operator/(Pack a, Pack b) { return a.v / b.v; }
  friend BRECCIA_HD Pack operator-(Pack a) { return -a.v; }
  BRECCIA_HD Pack& operator+=(Pack b) { return *this = *this + b; }
  BRECCIA_HD Pack& operator-=(Pack b) { return *this = *this - b; }
  BRECCIA_HD Pack& operator*=(Pack b) { return *this = *this * b; }
  friend BRECCIA_HD Mask operator<(Pack a, Pack b) { return {a.v < b.v}; }
  friend BRECCIA_HD Mask operator<=(Pack a, Pack b) { return {a.v <= b.v}; }
  friend BRECCIA_HD Mask operator>(Pack a, Pack b) { return {a.v > b.v}; }
  friend BRECCIA_HD Mask operator>=(Pack a, Pack b) { return {a.v >= b.v}; }
  friend BRECCIA_HD Mask operator==(Pack a, Pack b) { return {a.v == b.v}; }
};

template <class I, int W>
BRECCIA_HD PackMask<I, W> operator&(PackMask<I, W> a, PackMask<I, W> b) {
  return {a.v & b.v};
}
template <class I, int W>
BRECCIA_HD PackMask<I, W> operator|(PackMask<I, W> a, PackMask<I, W> b) {
  return {a.v | b.v};
}
template <class I, int W>
BRECCIA_HD PackMask<I, W> operator!(PackMask<I, W> a) {
  return {~a.v};
}
/// True where any lane is set.
template <class I, int W>
BRECCIA_HD bool any(PackMask<I, W> m) {
  I r = 0;
  for (int i = 0; i < W; ++i) r |= m.v[i];
  return r != 0;
}
template <class I, int W>
BRECCIA_HD bool lane(PackMask<I, W> m, int i) {
  return m.v[i] != 0;
}

template <class S, int W>
BRECCIA_HD Pack<S, W> select(typename Pack<S, W>::Mask m, Pack<S, W> a, Pack<S, W> b) {
  return Pack<S, W>(m.v ? a.v : b.v);
}
template <class S, int W>
BRECCIA_HD Pack<S, W> min(Pack<S, W> a, Pack<S, W> b) {
  return Pack<S, W>(a.v < b.v ? a.v : b.v);
}
template <class S, int W>
BRECCIA_HD Pack<S, W> max(Pack<S, W> a, Pack<S, W> b) {
  return Pack<S, W>(a.v > b.v ? a.v : b.v);
}
template <class S, int W>
BRECCIA_HD Pack<S, W> abs(Pack<S, W> a) {
  return Pack<S, W>(a.v < S(0) ? -a.v : a.v);
}
template <class S, int W>
BRECCIA_HD Pack<S, W> sqrt(Pack<S, W> a) {
  // g++ merges this loop into one vector square root (with -fno-math-errno).
  typename Pack<S, W>::Vector r;
  for (int i = 0; i < W; ++i) r[i] = std::sqrt(a.v[i]);
  return r;
}
template <class S, int W>
BRECCIA_HD S horizontal_sum(Pack<S, W> a) {
  S r = 0;
  for (int i = 0; i < W; ++i) r += a.v[i];
  return r;
}
template <class S, int W>
BRECCIA_HD S horizontal_max(Pack<S, W> a) {
  S r = a.v[0];
  for (int i = 1; i < W; ++i) r = a.v[i] > r ? a.v[i] : r;
  return r;
}
/// Lane-wise conversion between scalar types of the same lane count.
template <class To, class S, int W>
BRECCIA_HD Pack<To, W> convert(Pack<S, W> a) {
  return __builtin_convertvector(a.v, typename Pack<To, W>::Vector);
}

}  // namespace breccia

// SIMD packs: W lanes of a scalar S with the operators of a number, so that one physics source serves scalars, packs
// and CUDA threads. Host only (g++ and clang vector extensions). Packs wider than a register are made of two halves;
// the layout in memory is the same on every instruction set.
#pragma once

#include <immintrin.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#include "breccia/elementary.hpp"
#include "breccia/macros.hpp"

namespace breccia {

#if defined(__AVX512F__)
inline constexpr int kRegisterBytes = 64;
#elif defined(__AVX2__)
inline constexpr int kRegisterBytes = 32;
#else
inline constexpr int kRegisterBytes = 16;
#endif

namespace detail {
// The attribute is silently lost on a dependent typedef inside a class, hence this helper.
template <class S, int W>
struct VectorOf {
  static constexpr int kBytes = static_cast<int>(sizeof(S)) * W;
  using type [[gnu::vector_size(kBytes)]] = S;
};
template <std::size_t kBytes>
struct SignedOf;
template <>
struct SignedOf<4> {
  using type = std::int32_t;
};
template <>
struct SignedOf<8> {
  using type = std::int64_t;
};
template <class S, int W>
inline constexpr bool kIsWide = static_cast<int>(sizeof(S)) * W > kRegisterBytes;
}  // namespace detail

/// Lane mask of a pack: all bits set where true.
template <class I, int W>
struct PackMask {
  using Vector = typename detail::VectorOf<I, W>::type;
  Vector v;
};
template <class I, int W>
requires detail::kIsWide<I, W>
struct PackMask<I, W> {
  PackMask<I, W / 2> low, high;
};

/// W lanes of S. Arithmetic is lane-wise; a scalar operand is broadcast. The alignment is stated because that of a wide
/// vector depends on the instruction set, and packs in memory are shared by all copies of the kernels.
template <class S, int W>
struct alignas(sizeof(S) * W) Pack {
  using Scalar = S;
  using Vector = typename detail::VectorOf<S, W>::type;
  using Mask = PackMask<typename detail::SignedOf<sizeof(S)>::type, W>;
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
  friend BRECCIA_HD Mask operator<(Pack a, Pack b) { return {a.v < b.v}; }
  friend BRECCIA_HD Mask operator<=(Pack a, Pack b) { return {a.v <= b.v}; }
  friend BRECCIA_HD Mask operator>(Pack a, Pack b) { return {a.v > b.v}; }
  friend BRECCIA_HD Mask operator>=(Pack a, Pack b) { return {a.v >= b.v}; }
  friend BRECCIA_HD Mask operator==(Pack a, Pack b) { return {a.v == b.v}; }

  // Bits, for integer lanes only.
  friend BRECCIA_HD Pack operator&(Pack a, Pack b) { return a.v & b.v; }
  friend BRECCIA_HD Pack operator|(Pack a, Pack b) { return a.v | b.v; }
  friend BRECCIA_HD Pack operator^(Pack a, Pack b) { return a.v ^ b.v; }
  friend BRECCIA_HD Pack operator>>(Pack a, int bits) { return a.v >> bits; }
  friend BRECCIA_HD Pack operator<<(Pack a, int bits) { return a.v << bits; }
};

template <class S, int W>
requires detail::kIsWide<S, W>
struct alignas(sizeof(S) * W) Pack<S, W> {
  using Scalar = S;
  using Half = Pack<S, W / 2>;
  using Mask = PackMask<typename detail::SignedOf<sizeof(S)>::type, W>;
  static constexpr int kLanes = W;

  Half low, high;

  Pack() = default;
  BRECCIA_HD Pack(Half l, Half h) : low(l), high(h) {}
  BRECCIA_HD Pack(S s) : low(s), high(s) {}

  BRECCIA_HD static Pack load(const S* p) { return {Half::load(p), Half::load(p + W / 2)}; }
  BRECCIA_HD void store(S* p) const {
    low.store(p);
    high.store(p + W / 2);
  }
  BRECCIA_HD S operator[](int lane) const { return lane < W / 2 ? low[lane] : high[lane - W / 2]; }
  BRECCIA_HD void set(int lane, S s) { lane < W / 2 ? low.set(lane, s) : high.set(lane - W / 2, s); }

  friend BRECCIA_HD Pack operator+(Pack a, Pack b) { return {a.low + b.low, a.high + b.high}; }
  friend BRECCIA_HD Pack operator-(Pack a, Pack b) { return {a.low - b.low, a.high - b.high}; }
  friend BRECCIA_HD Pack operator*(Pack a, Pack b) { return {a.low * b.low, a.high * b.high}; }
  friend BRECCIA_HD Pack operator/(Pack a, Pack b) { return {a.low / b.low, a.high / b.high}; }
  friend BRECCIA_HD Pack operator-(Pack a) { return {-a.low, -a.high}; }
  friend BRECCIA_HD Mask operator<(Pack a, Pack b) { return {a.low < b.low, a.high < b.high}; }
  friend BRECCIA_HD Mask operator<=(Pack a, Pack b) { return {a.low <= b.low, a.high <= b.high}; }
  friend BRECCIA_HD Mask operator>(Pack a, Pack b) { return {a.low > b.low, a.high > b.high}; }
  friend BRECCIA_HD Mask operator>=(Pack a, Pack b) { return {a.low >= b.low, a.high >= b.high}; }
  friend BRECCIA_HD Mask operator==(Pack a, Pack b) { return {a.low == b.low, a.high == b.high}; }
  friend BRECCIA_HD Pack operator&(Pack a, Pack b) { return {a.low & b.low, a.high & b.high}; }
  friend BRECCIA_HD Pack operator|(Pack a, Pack b) { return {a.low | b.low, a.high | b.high}; }
  friend BRECCIA_HD Pack operator^(Pack a, Pack b) { return {a.low ^ b.low, a.high ^ b.high}; }
  friend BRECCIA_HD Pack operator>>(Pack a, int bits) { return {a.low >> bits, a.high >> bits}; }
  friend BRECCIA_HD Pack operator<<(Pack a, int bits) { return {a.low << bits, a.high << bits}; }
};

template <class S, int W>
BRECCIA_HD Pack<S, W>& operator+=(Pack<S, W>& a, std::type_identity_t<Pack<S, W>> b) {
  return a = a + b;
}
template <class S, int W>
BRECCIA_HD Pack<S, W>& operator-=(Pack<S, W>& a, std::type_identity_t<Pack<S, W>> b) {
  return a = a - b;
}
template <class S, int W>
BRECCIA_HD Pack<S, W>& operator*=(Pack<S, W>& a, std::type_identity_t<Pack<S, W>> b) {
  return a = a * b;
}

namespace detail {
template <std::size_t kFirst, class S, int W, std::size_t... kLane>
BRECCIA_HD Pack<S, W / 2> lanes_from(Pack<S, W> a, std::index_sequence<kLane...>) {
  return Pack<S, W / 2>(__builtin_shufflevector(a.v, a.v, (kFirst + kLane)...));
}
template <class S, int W, std::size_t... kLane>
BRECCIA_HD Pack<S, 2 * W> concatenated(Pack<S, W> a, Pack<S, W> b, std::index_sequence<kLane...>) {
  return Pack<S, 2 * W>(__builtin_shufflevector(a.v, b.v, kLane...));
}
}  // namespace detail

/// Eight lanes rearranged: lane i of the result is lane kFrom[i] of a.
template <int... kFrom, class S>
BRECCIA_HD Pack<S, 8> rearranged(Pack<S, 8> a) {
  static_assert(sizeof...(kFrom) == 8);
  if constexpr (detail::kIsWide<S, 8>) {
    S from[8];
    a.store(from);
    const S to[8] = {from[kFrom]...};
    return Pack<S, 8>::load(to);
  } else {
    return Pack<S, 8>(__builtin_shufflevector(a.v, a.v, kFrom...));
  }
}

/// Both halves of sixteen lanes rearranged alike; for registers that hold them.
template <int... kFrom, class S>
BRECCIA_HD Pack<S, 16> rearranged(Pack<S, 16> a) {
  static_assert(sizeof...(kFrom) == 8 && !detail::kIsWide<S, 16>);
  return Pack<S, 16>(__builtin_shufflevector(a.v, a.v, kFrom..., (8 + kFrom)...));
}

/// First and second half of the lanes.
template <class S, int W>
BRECCIA_HD Pack<S, W / 2> lower(Pack<S, W> a) {
  if constexpr (detail::kIsWide<S, W>) {
    return a.low;
  } else {
    return detail::lanes_from<0>(a, std::make_index_sequence<W / 2>());
  }
}
template <class S, int W>
BRECCIA_HD Pack<S, W / 2> upper(Pack<S, W> a) {
  if constexpr (detail::kIsWide<S, W>) {
    return a.high;
  } else {
    return detail::lanes_from<W / 2>(a, std::make_index_sequence<W / 2>());
  }
}
/// The lanes of a, then those of b.
template <class S, int W>
BRECCIA_HD Pack<S, 2 * W> join(Pack<S, W> a, Pack<S, W> b) {
  if constexpr (detail::kIsWide<S, 2 * W>) {
    return {a, b};
  } else {
    return detail::concatenated(a, b, std::make_index_sequence<2 * W>());
  }
}

/// `low` in the lower half of the lanes, `high` in the upper half, both from memory.
template <class S, int W>
BRECCIA_HD Pack<S, W> halves(const S& low, const S& high) {
#if defined(__AVX512F__)
  // Two loads and no shuffle; g++ 12 finds that by itself only without the mask.
  if constexpr (std::is_same_v<S, float> && W == 16) {
    return __builtin_bit_cast(typename Pack<S, W>::Vector,
                              _mm512_mask_broadcastss_ps(_mm512_set1_ps(low), 0xff00, _mm_load_ss(&high)));
  }
#endif
  return join(Pack<S, W / 2>(low), Pack<S, W / 2>(high));
}

/// W / 2 lanes from memory, twice.
template <class S, int W>
BRECCIA_HD Pack<S, W> load_twice(const S* p) {
#if defined(__AVX512DQ__)
  if constexpr (std::is_same_v<S, float> && W == 16) {
    return __builtin_bit_cast(typename Pack<S, W>::Vector, _mm512_maskz_broadcast_f32x8(0xffff, _mm256_loadu_ps(p)));
  }
#endif
  const auto half = Pack<S, W / 2>::load(p);
  return join(half, half);
}

template <class I, int W>
BRECCIA_HD PackMask<I, W> operator&(PackMask<I, W> a, PackMask<I, W> b) {
  if constexpr (detail::kIsWide<I, W>) {
    return {a.low & b.low, a.high & b.high};
  } else {
    return {a.v & b.v};
  }
}
template <class I, int W>
BRECCIA_HD PackMask<I, W> operator|(PackMask<I, W> a, PackMask<I, W> b) {
  if constexpr (detail::kIsWide<I, W>) {
    return {a.low | b.low, a.high | b.high};
  } else {
    return {a.v | b.v};
  }
}
template <class I, int W>
BRECCIA_HD PackMask<I, W> operator!(PackMask<I, W> a) {
  if constexpr (detail::kIsWide<I, W>) {
    return {!a.low, !a.high};
  } else {
    return {~a.v};
  }
}
namespace detail {
// g++ 12 makes a tree of shuffles of a plain loop over the lanes.
template <class V>
requires(sizeof(V) <= 16) BRECCIA_HD bool any_bit(V mask) {
  std::uint64_t bits[2] = {0, 0};
  std::memcpy(bits, &mask, sizeof(V));
  return (bits[0] | bits[1]) != 0;
}
#if defined(__AVX2__)
template <class V>
requires(sizeof(V) == 32) BRECCIA_HD bool any_bit(V mask) {
  return _mm256_movemask_epi8(__builtin_bit_cast(__m256i, mask)) != 0;
}
#endif
#if defined(__AVX512F__)
template <class V>
requires(sizeof(V) == 64) BRECCIA_HD bool any_bit(V mask) {
  const __m512i bits = __builtin_bit_cast(__m512i, mask);
  return _mm512_test_epi32_mask(bits, bits) != 0;
}
#endif
}  // namespace detail

/// True where any lane is set.
template <class I, int W>
BRECCIA_HD bool any(PackMask<I, W> m) {
  if constexpr (detail::kIsWide<I, W>) {
    return any(m.low | m.high);
  } else {
    return detail::any_bit(m.v);
  }
}

template <class S, int W>
BRECCIA_HD Pack<S, W> select(typename Pack<S, W>::Mask m, Pack<S, W> a, Pack<S, W> b) {
  if constexpr (detail::kIsWide<S, W>) {
    return {select(m.low, a.low, b.low), select(m.high, a.high, b.high)};
  } else {
    return Pack<S, W>(m.v ? a.v : b.v);
  }
}
template <class S, int W>
BRECCIA_HD Pack<S, W> min(Pack<S, W> a, Pack<S, W> b) {
  return select(a < b, a, b);
}
template <class S, int W>
BRECCIA_HD Pack<S, W> max(Pack<S, W> a, Pack<S, W> b) {
  return select(a > b, a, b);
}
template <class S, int W>
BRECCIA_HD Pack<S, W> abs(Pack<S, W> a) {
  return select(a < Pack<S, W>(S(0)), -a, a);
}
template <class S, int W>
BRECCIA_HD Pack<S, W> sqrt(Pack<S, W> a) {
  if constexpr (detail::kIsWide<S, W>) {
    return {sqrt(a.low), sqrt(a.high)};
  } else {
    // g++ merges this loop into one vector square root (with -fno-math-errno).
    typename Pack<S, W>::Vector r = a.v;
    for (int i = 0; i < W; ++i) r[i] = std::sqrt(r[i]);
    return r;
  }
}
template <class S, int W>
BRECCIA_HD Pack<S, W> reciprocal(Pack<S, W> a) {
#if defined(__AVX512F__)
  if constexpr (std::is_same_v<S, float> && W == 16) {
    // An approximation of 14 bits and a step of Newton's.
    const auto x = __builtin_bit_cast(__m512, a.v);
    const __m512 y = _mm512_maskz_rcp14_ps(0xffff, x);
    const __m512 missing = _mm512_fnmadd_ps(x, y, _mm512_set1_ps(1.0F));
    return __builtin_bit_cast(typename Pack<S, W>::Vector, _mm512_fmadd_ps(y, missing, y));
  }
#endif
  return Pack<S, W>(S(1)) / a;
}
/// Halving sums: a tree of depth log2(W) instead of a chain of W additions.
template <class S, int W>
BRECCIA_HD S horizontal_sum(Pack<S, W> a) {
  if constexpr (W == 1) {
    return a[0];
  } else {
    return horizontal_sum(lower(a) + upper(a));
  }
}
template <class S, int W>
BRECCIA_HD S horizontal_max(Pack<S, W> a) {
  if constexpr (W == 1) {
    return a[0];
  } else {
    return horizontal_max(max(lower(a), upper(a)));
  }
}
/// Lane-wise conversion between scalar types of the same lane count.
template <class To, class S, int W>
BRECCIA_HD Pack<To, W> convert(Pack<S, W> a) {
  if constexpr (detail::kIsWide<S, W> || detail::kIsWide<To, W>) {
    return join(convert<To>(lower(a)), convert<To>(upper(a)));
  } else {
    return Pack<To, W>(__builtin_convertvector(a.v, typename Pack<To, W>::Vector));
  }
}
/// The same bits as lanes of another scalar type of the same size.
template <class To, class S, int W>
BRECCIA_HD Pack<To, W> reinterpret(Pack<S, W> a) {
  static_assert(sizeof(To) == sizeof(S));
  if constexpr (detail::kIsWide<S, W>) {
    return {reinterpret<To>(a.low), reinterpret<To>(a.high)};
  } else {
    return Pack<To, W>((typename Pack<To, W>::Vector)(a.v));
  }
}

namespace detail {
template <class S, int W>
BRECCIA_HD Pack<S, W> multiply_add(Pack<S, W> a, Pack<S, W> b, Pack<S, W> c) {
  if constexpr (kIsWide<S, W>) {
    return {multiply_add(a.low, b.low, c.low), multiply_add(a.high, b.high, c.high)};
  } else {
    // g++ merges this loop into vector instructions.
    typename Pack<S, W>::Vector r;
    for (int i = 0; i < W; ++i) r[i] = multiply_add(a.v[i], b.v[i], c.v[i]);
    return r;
  }
}
}  // namespace detail

}  // namespace breccia

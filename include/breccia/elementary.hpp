// exp, log, log1p and cbrt templated on the scalar type, so that scalars, packs and CUDA threads share one source and
// no libm call breaks the vectors. Bit tricks use logical shifts and magic-number conversions only: arithmetic 64-bit
// shifts and int64 conversions exist in AVX-512 alone. Arguments are finite; NaN is not passed on.
#pragma once

#include <cstdint>
#include <cstring>

#include "breccia/macros.hpp"
#include "breccia/math.hpp"

namespace breccia {

template <class S, int W>
struct Pack;  // pack.hpp, host only

namespace detail {

/// Layout and series lengths of an IEEE format. kRound pushes the integer part of a sum into the low mantissa bits.
template <class R>
struct FloatFormat;

template <>
struct FloatFormat<float> {
  using Bits = std::uint32_t;
  static constexpr int kMantissaBits = 23;
  static constexpr Bits kSqrtHalfBits = 0x3F3504F3U;
  static constexpr Bits kExponentBias = 128U;
  static constexpr Bits kIntegerBits = 0x4B000000U;  // 2^23
  static constexpr float kInteger = 8388608.0F;
  static constexpr float kRound = 12582912.0F;  // 1.5 * 2^23
  static constexpr float kLn2High = 0.693359375F, kLn2Low = -2.12194440e-4F;
  static constexpr float kExpMin = -87.0F, kExpMax = 88.0F;
  static constexpr float kSmallest = 1.17549435e-38F;
  static constexpr int kExpTerms = 7, kLogTerms = 5;
};

template <>
struct FloatFormat<double> {
  using Bits = std::uint64_t;
  static constexpr int kMantissaBits = 52;
  static constexpr Bits kSqrtHalfBits = 0x3FE6A09E667F3BCDULL;
  static constexpr Bits kExponentBias = 1024U;
  static constexpr Bits kIntegerBits = 0x4330000000000000ULL;  // 2^52
  static constexpr double kInteger = 4503599627370496.0;
  static constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52
  static constexpr double kLn2High = 6.93147180369123816490e-01, kLn2Low = 1.90821492927058770002e-10;
  static constexpr double kExpMin = -708.0, kExpMax = 709.0;
  static constexpr double kSmallest = 2.2250738585072014e-308;
  static constexpr int kExpTerms = 13, kLogTerms = 10;
};

/// Unsigned integers (or a pack of them) with the bits of T.
template <class T>
struct BitsOf {
  using type = typename FloatFormat<T>::Bits;
};
template <class S, int W>
struct BitsOf<Pack<S, W>> {
  using type = Pack<typename FloatFormat<S>::Bits, W>;
};

template <class T>
BRECCIA_HD typename BitsOf<T>::type to_bits(const T& x) {
  typename BitsOf<T>::type bits;
  std::memcpy(&bits, &x, sizeof(bits));
  return bits;
}
template <class T>
BRECCIA_HD T from_bits(const typename BitsOf<T>::type& bits) {
  T x;
  std::memcpy(&x, &bits, sizeof(bits));
  return x;
}

/// a b + c, rounded once where the processor fuses them. Written out so that the compiler cannot choose differently for
/// scalars and packs, which then give the same bits.
BRECCIA_HD float multiply_add(float a, float b, float c) {
#if defined(__FMA__) || defined(__CUDA_ARCH__)
  return __builtin_fmaf(a, b, c);
#else
  return a * b + c;
#endif
}
BRECCIA_HD double multiply_add(double a, double b, double c) {
#if defined(__FMA__) || defined(__CUDA_ARCH__)
  return __builtin_fma(a, b, c);
#else
  return a * b + c;
#endif
}
template <class S, int W>
BRECCIA_HD Pack<S, W> multiply_add(Pack<S, W> a, Pack<S, W> b, Pack<S, W> c);

}  // namespace detail

/// e^x to 1 ulp. x is clamped to [-87, 88] (float) or [-708, 709] (double), where the result is a normal number.
template <class T>
BRECCIA_HD T exp(T x) {
  using R = scalar_of<T>;
  using Format = detail::FloatFormat<R>;
  x = min(max(x, T(Format::kExpMin)), T(Format::kExpMax));
  const T shifted = detail::multiply_add(x, T(R(1.44269504088896340736)), T(Format::kRound));
  const T k = shifted - T(Format::kRound);
  const T r = detail::multiply_add(k, T(-Format::kLn2Low), detail::multiply_add(k, T(-Format::kLn2High), x));
  // Taylor series of (e^r - 1 - r) / r^2 on |r| <= ln(2)/2, innermost term first: 1/2 (1 + r/3 (1 + r/4 (...))).
  T series(R(1));
  for (int n = Format::kExpTerms; n >= 3; --n) series = detail::multiply_add(series, r * T(R(1) / R(n)), T(R(1)));
  const T mantissa = T(R(1)) + detail::multiply_add(r * r, T(R(0.5)) * series, r);
  return detail::from_bits<T>(detail::to_bits(mantissa) + (detail::to_bits(shifted) << Format::kMantissaBits));
}

/// Natural logarithm to 1 ulp. x below the smallest normal number counts as that number.
template <class T>
BRECCIA_HD T log(T x) {
  using R = scalar_of<T>;
  using Format = detail::FloatFormat<R>;
  constexpr int kShift = Format::kMantissaBits;
  constexpr auto kBias = Format::kExponentBias << kShift;
  const auto bits = detail::to_bits(max(x, T(Format::kSmallest)));
  const auto exponent = (bits - Format::kSqrtHalfBits + kBias) >> kShift;
  const T e = detail::from_bits<T>(exponent | Format::kIntegerBits) - T(Format::kInteger + R(Format::kExponentBias));
  const T f = detail::from_bits<T>(bits - (exponent << kShift) + kBias) - T(R(1));
  // ln(1 + f) = 2 atanh(s), s = f / (2 + f), |s| <= 0.172, arranged so that f itself is added last.
  const T s = f / (T(R(2)) + f);
  const T z = s * s;
  T series(R(2) / R(2 * Format::kLogTerms + 1));
  for (int n = Format::kLogTerms - 1; n >= 1; --n) series = detail::multiply_add(series, z, T(R(2) / R(2 * n + 1)));
  const T half = T(R(0.5)) * f;
  const T curvature = detail::multiply_add(z, series, half * f);
  const T correction = detail::multiply_add(s, curvature, e * T(Format::kLn2Low));
  return detail::multiply_add(e, T(Format::kLn2High), f - detail::multiply_add(half, f, -correction));
}

/// ln(1 + x) to 2 ulp for x > -1, also for tiny x.
template <class T>
BRECCIA_HD T log1p(T x) {
  using R = scalar_of<T>;
  const T u = T(R(1)) + x;
  const T lost = select(x > T(R(1)), T(R(1)) - (u - x), x - (u - T(R(1))));
  return log(u) + lost / max(u, T(detail::FloatFormat<R>::kSmallest));
}

/// Cube root to 1 ulp for x >= 0; exact at 0 and 1.
template <class T>
BRECCIA_HD T cbrt(T x) {
  using R = scalar_of<T>;
  const T y = exp(log(x) * T(R(1) / R(3)));
  const T y2 = y * y;
  const T newton = y - detail::multiply_add(y2, y, -x) / (T(R(3)) * y2);
  return select(x > T(R(0)), newton, T(R(0)));
}

}  // namespace breccia

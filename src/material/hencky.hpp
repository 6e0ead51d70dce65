// Functions of the elastic strain without eigenvectors. The state is the traceless tensor E = b_e / (tr b_e / 3) - I;
// with q = tr(E^2) / 2 and r = det E, Cayley-Hamilton reads E^3 = q E + r I, so that every power series in E collapses
// to c0 I + c1 E + c2 E^2. The physical Hencky strain is h = dev ln(I + E) / 2.
#pragma once

#include "breccia/elementary.hpp"
#include "breccia/linalg.hpp"
#include "breccia/math.hpp"
#include "material/eigen.hpp"

namespace breccia::material {

/// Highest powers of the series: truncation stays below rounding while no eigenvalue of E exceeds 0.1.
template <class R>
struct SeriesOrder;
template <>
struct SeriesOrder<float> {
  static constexpr int kLog = 7, kPower = 6;
};
template <>
struct SeriesOrder<double> {
  static constexpr int kLog = 14, kPower = 13;
};
/// Largest q of the series; |eigenvalue|^2 <= 4 q / 3 for a traceless tensor.
inline constexpr double kSeriesLimit = 0.0075;
/// Least eigenvalue of I + E that the fall-back takes a logarithm of: only rounding or an inverted step goes below.
inline constexpr double kLeastStretch = 1.0e-7;

/// A traceless tensor with what its series need.
template <class T>
struct TracelessPowers {
  Dev3<T> square;  ///< dev(E^2)
  T q;             ///< tr(E^2) / 2
  T r;             ///< det E
};

template <class T>
BRECCIA_HD TracelessPowers<T> traceless_powers(const Dev3<T>& e) {
  using R = scalar_of<T>;
  const T zz = e.zz();
  const T square_xx = e.xx * e.xx + e.xy * e.xy + e.xz * e.xz;
  const T square_yy = e.yy * e.yy + e.xy * e.xy + e.yz * e.yz;
  const T square_zz = zz * zz + e.xz * e.xz + e.yz * e.yz;
  const T square_xy = e.xy * (e.xx + e.yy) + e.xz * e.yz;
  const T square_xz = e.xz * (e.xx + zz) + e.xy * e.yz;
  const T square_yz = e.yz * (e.yy + zz) + e.xy * e.xz;
  const T q = T(R(0.5)) * (square_xx + square_yy + square_zz);
  const T mean = q * T(R(2) / R(3));
  // The adjugate of a traceless tensor is E^2 - q I.
  const T r = e.xx * (square_xx - q) + e.xy * square_xy + e.xz * square_xz;
  return {{square_xx - mean, square_yy - mean, square_xy, square_xz, square_yz}, q, r};
}

/// c0 I + c1 E + c2 E^2.
template <class T>
struct ReducedSeries {
  T c0, c1, c2;
  /// Multiplies by E and adds `coefficient` I.
  BRECCIA_HD void horner(T coefficient, const TracelessPowers<T>& p) {
    const T old_c1 = c1;
    c1 = p.q * c2 + c0;
    c0 = p.r * c2 + coefficient;
    c2 = old_c1;
  }
};

namespace detail {

/// Deviator of sum_i f_i v_i v_i^T.
template <class T>
BRECCIA_HD Dev3<T> spectral_deviator(const SymmetricEigen<T>& s, const T (&f)[3]) {
  using R = scalar_of<T>;
  const T mean = (f[0] + f[1] + f[2]) * T(R(1) / R(3));
  Dev3<T> d{T(R(0)), T(R(0)), T(R(0)), T(R(0)), T(R(0))};
  for (int i = 0; i < 3; ++i) {
    const Vec3<T> v = s.vector[i];
    d = d + (f[i] - mean) * Dev3<T>{v.x * v.x, v.y * v.y, v.x * v.y, v.x * v.z, v.y * v.z};
  }
  return d;
}

/// Of x^n in ln(1 + x).
template <class T>
BRECCIA_HD T log_coefficient(int n) {
  using R = scalar_of<T>;
  return T((n % 2 == 0 ? R(-1) : R(1)) / R(n));
}

/// ln(1 + eigenvalue) of the traceless E.
template <class T>
BRECCIA_HD void log_stretches(const SymmetricEigen<T>& s, T (&logs)[3]) {
  using R = scalar_of<T>;
  for (int i = 0; i < 3; ++i) logs[i] = log1p(max(s.value[i], T(R(kLeastStretch - 1.0))));
}

template <class T>
BRECCIA_HD SymmetricEigen<T> traceless_eigen(const Dev3<T>& e) {
  return symmetric_eigen(Sym3<T>{e.xx, e.yy, e.zz(), e.xy, e.xz, e.yz});
}

template <class T, class Mask>
BRECCIA_HD Dev3<T> select_tensor(Mask m, const Dev3<T>& a, const Dev3<T>& b) {
  return {select(m, a.xx, b.xx), select(m, a.yy, b.yy), select(m, a.xy, b.xy), select(m, a.xz, b.xz),
          select(m, a.yz, b.yz)};
}

}  // namespace detail

/// a : a for a traceless symmetric tensor.
template <class T>
BRECCIA_HD T squared_norm(const Dev3<T>& a) {
  using R = scalar_of<T>;
  return T(R(2)) * (a.xx * a.xx + a.xx * a.yy + a.yy * a.yy + a.xy * a.xy + a.xz * a.xz + a.yz * a.yz);
}

/// dev ln(I + E) = 2 h, by series; by eigenvalues in the lanes where an eigenvalue of E may exceed 0.1.
template <class T>
BRECCIA_HD Dev3<T> deviatoric_log(const Dev3<T>& e, const TracelessPowers<T>& p) {
  using R = scalar_of<T>;
  constexpr int kOrder = SeriesOrder<R>::kLog;
  static_assert(kOrder > 2);
  ReducedSeries<T> s{detail::log_coefficient<T>(kOrder - 2), detail::log_coefficient<T>(kOrder - 1),
                     detail::log_coefficient<T>(kOrder)};
  for (int n = kOrder - 3; n >= 1; --n) s.horner(detail::log_coefficient<T>(n), p);
  s.horner(T(R(0)), p);
  Dev3<T> result = s.c1 * e + s.c2 * p.square;
  const auto large = p.q > T(R(kSeriesLimit));
  if (any(large)) [[unlikely]] {
    const SymmetricEigen<T> eigen = detail::traceless_eigen(e);
    T logs[3];
    detail::log_stretches(eigen, logs);
    result = detail::select_tensor(large, detail::spectral_deviator(eigen, logs), result);
  }
  return result;
}

/// The traceless form of (I + E)^exponent: the elastic strain after the Hencky strain shrank by `exponent` in [0, 1].
template <class T>
BRECCIA_HD Dev3<T> traceless_power(const Dev3<T>& e, const TracelessPowers<T>& p, T exponent) {
  using R = scalar_of<T>;
  constexpr int kOrder = SeriesOrder<R>::kPower;
  T binomial[kOrder + 1];
  binomial[0] = T(R(1));
  for (int n = 1; n <= kOrder; ++n) binomial[n] = binomial[n - 1] * ((exponent - T(R(n - 1))) * T(R(1) / R(n)));
  ReducedSeries<T> s{binomial[kOrder - 2], binomial[kOrder - 1], binomial[kOrder]};
  for (int n = kOrder - 3; n >= 0; --n) s.horner(binomial[n], p);
  const T inverse_mean = T(R(1)) / (s.c0 + s.c2 * p.q * T(R(2) / R(3)));
  Dev3<T> result = (s.c1 * inverse_mean) * e + (s.c2 * inverse_mean) * p.square;
  const auto large = p.q > T(R(kSeriesLimit));
  if (any(large)) [[unlikely]] {
    const SymmetricEigen<T> eigen = detail::traceless_eigen(e);
    T logs[3];
    detail::log_stretches(eigen, logs);
    T stretch[3];
    for (int i = 0; i < 3; ++i) stretch[i] = exp(exponent * logs[i]);
    const T mean = (stretch[0] + stretch[1] + stretch[2]) * T(R(1) / R(3));
    const Dev3<T> spectral = (T(R(1)) / mean) * detail::spectral_deviator(eigen, stretch);
    result = detail::select_tensor(large, spectral, result);
  }
  return result;
}

}  // namespace breccia::material

// How strains and volume move with a step of deformation I + A, without ever forming numbers close to 1.
#pragma once

#include "breccia/linalg.hpp"
#include "breccia/math.hpp"

namespace breccia::material {

/// Least factor by which J may shrink in one step: a step with det(I + A) <= 0 has no meaning (hard case 3).
inline constexpr double kLeastVolumeRatio = 0.1;
inline constexpr double kLeastVolumeIncrement = kLeastVolumeRatio - 1.0;
/// Least J, so that repeated such steps cannot overflow the equation of state.
inline constexpr double kLeastVolume = 1.0e-3;

template <class T>
BRECCIA_HD Mat3<T> scaled(const Mat3<T>& a, T s) {
  return {s * a.xx, s * a.xy, s * a.xz, s * a.yx, s * a.yy, s * a.yz, s * a.zx, s * a.zy, s * a.zz};
}

/// det(I + A) - 1 from the invariants of A, exact to rounding of the increment.
template <class T>
BRECCIA_HD T volume_increment(const Mat3<T>& a) {
  const T minors = (a.xx * a.yy - a.xy * a.yx) + (a.xx * a.zz - a.xz * a.zx) + (a.yy * a.zz - a.yz * a.zy);
  return trace(a) + (minors + determinant(a));
}

/// J := J (1 + increment), kept in [kLeastVolume, J_max] and shrinking by no more than kLeastVolumeRatio.
template <class T>
BRECCIA_HD void change_volume(Accumulator<T>& volume_change, T increment, T volume_change_max) {
  using R = scalar_of<T>;
  const T j = volume_change.value();
  const T ratio = max(increment, T(R(kLeastVolumeIncrement)));
  const T change = ratio + j * ratio;
  volume_change.add(min(max(change, T(R(kLeastVolume - 1.0)) - j), volume_change_max - j));
}

/// (I + A)(I + S)(I + A)^T - I for symmetric S.
template <class T>
BRECCIA_HD Sym3<T> carry(const Mat3<T>& a, const Sym3<T>& s) {
  // W = A (I + S); the result is S + W + W^T + W A^T.
  const Mat3<T> w = {a.xx + (a.xx * s.xx + a.xy * s.xy + a.xz * s.xz), a.xy + (a.xx * s.xy + a.xy * s.yy + a.xz * s.yz),
                     a.xz + (a.xx * s.xz + a.xy * s.yz + a.xz * s.zz), a.yx + (a.yx * s.xx + a.yy * s.xy + a.yz * s.xz),
                     a.yy + (a.yx * s.xy + a.yy * s.yy + a.yz * s.yz), a.yz + (a.yx * s.xz + a.yy * s.yz + a.yz * s.zz),
                     a.zx + (a.zx * s.xx + a.zy * s.xy + a.zz * s.xz), a.zy + (a.zx * s.xy + a.zy * s.yy + a.zz * s.yz),
                     a.zz + (a.zx * s.xz + a.zy * s.yz + a.zz * s.zz)};
  return {s.xx + (w.xx + w.xx + (w.xx * a.xx + w.xy * a.xy + w.xz * a.xz)),
          s.yy + (w.yy + w.yy + (w.yx * a.yx + w.yy * a.yy + w.yz * a.yz)),
          s.zz + (w.zz + w.zz + (w.zx * a.zx + w.zy * a.zy + w.zz * a.zz)),
          s.xy + (w.xy + w.yx + (w.xx * a.yx + w.xy * a.yy + w.xz * a.yz)),
          s.xz + (w.xz + w.zx + (w.xx * a.zx + w.xy * a.zy + w.xz * a.zz)),
          s.yz + (w.yz + w.zy + (w.yx * a.zx + w.yy * a.zy + w.yz * a.zz))};
}

/// The same for the traceless E = b / (tr b / 3) - I: only the shape of b is kept.
template <class T>
BRECCIA_HD Dev3<T> carry_traceless(const Mat3<T>& a, const Dev3<T>& e) {
  using R = scalar_of<T>;
  const Sym3<T> s = carry(a, Sym3<T>{e.xx, e.yy, e.zz(), e.xy, e.xz, e.yz});
  const T mean = (s.xx + s.yy + s.zz) * T(R(1) / R(3));
  const T inverse = reciprocal(max(T(R(1)) + mean, T(R(1.0e-12))));
  return inverse * Dev3<T>{s.xx - mean, s.yy - mean, s.xy, s.xz, s.yz};
}

}  // namespace breccia::material

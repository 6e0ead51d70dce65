// Symmetric 3x3 eigen-problems in lanes: branch-free, a fixed number of sweeps, harmless at repeated eigenvalues.
#pragma once

#include "breccia/linalg.hpp"
#include "breccia/math.hpp"

namespace breccia::material {

/// Eigenvalues (unordered) and orthonormal eigenvectors.
template <class T>
struct SymmetricEigen {
  T value[3];
  Vec3<T> vector[3];
};

namespace detail {

/// One Jacobi rotation that makes the element `pq` zero; `rp`, `rq` are the elements that link the third axis.
template <class T>
BRECCIA_HD void rotate(T& pp, T& qq, T& pq, T& rp, T& rq, Vec3<T>& p, Vec3<T>& q) {
  using R = scalar_of<T>;
  const T difference = qq - pp;
  const T twice = T(R(2)) * pq;
  const T denominator = abs(difference) + sqrt(difference * difference + twice * twice);
  const T magnitude = twice / max(denominator, T(R(1.0e-30)));
  const T tangent = select(difference < T(R(0)), -magnitude, magnitude);
  const T cosine = T(R(1)) / sqrt(T(R(1)) + tangent * tangent);
  const T sine = tangent * cosine;
  pp -= tangent * pq;
  qq += tangent * pq;
  pq = T(R(0));
  const T rp_old = rp;
  rp = cosine * rp_old - sine * rq;
  rq = sine * rp_old + cosine * rq;
  const Vec3<T> p_old = p;
  p = cosine * p_old - sine * q;
  q = sine * p_old + cosine * q;
}

}  // namespace detail

/// Cyclic Jacobi. Convergence is cubic once the off-diagonal is small, so six sweeps exhaust double precision.
template <class T>
BRECCIA_HD SymmetricEigen<T> symmetric_eigen(Sym3<T> a) {
  using R = scalar_of<T>;
  const T zero(R(0)), one(R(1));
  SymmetricEigen<T> e;
  Vec3<T> x{one, zero, zero}, y{zero, one, zero}, z{zero, zero, one};
  for (int sweep = 0; sweep < 6; ++sweep) {
    detail::rotate(a.xx, a.yy, a.xy, a.xz, a.yz, x, y);
    detail::rotate(a.xx, a.zz, a.xz, a.xy, a.yz, x, z);
    detail::rotate(a.yy, a.zz, a.yz, a.xy, a.xz, y, z);
  }
  e.value[0] = a.xx;
  e.value[1] = a.yy;
  e.value[2] = a.zz;
  e.vector[0] = x;
  e.vector[1] = y;
  e.vector[2] = z;
  return e;
}

/// False only where no eigenvalue exceeds `limit`; true at the latest where the largest is within |dev a| / sqrt(6) of
/// it. Without determinant and roots: mean + 2 sqrt(|dev a|^2 / 6) is no less than any eigenvalue.
template <class T>
BRECCIA_HD auto eigenvalue_may_exceed(const Sym3<T>& a, T limit) {
  using R = scalar_of<T>;
  const T mean = (a.xx + a.yy + a.zz) * T(R(1) / R(3));
  const T xx = a.xx - mean, yy = a.yy - mean, zz = a.zz - mean;
  const T half_square = T(R(0.5)) * (xx * xx + yy * yy + zz * zz) + (a.xy * a.xy + a.xz * a.xz + a.yz * a.yz);
  const T above_mean = limit - mean;
  return (above_mean < T(R(0))) | (above_mean * above_mean < T(R(4) / R(3)) * half_square);
}

/// Largest eigenvalue alone, without eigenvectors, accurate relative to |a| however small that is (a few ulp; square
/// root of that where the two largest coincide). With the deviator scaled to unit size it is 1 + u, where
/// u sqrt(3 + u) = 2 y and y = cos(3/2 * Lode angle): a well-conditioned form of the cubic, solved by Newton steps.
template <class T>
BRECCIA_HD T largest_eigenvalue(const Sym3<T>& a) {
  using R = scalar_of<T>;
  const T one(R(1)), two(R(2));
  const T mean = (a.xx + a.yy + a.zz) * T(R(1) / R(3));
  const T xx = a.xx - mean, yy = a.yy - mean, zz = a.zz - mean;
  const T half_square = T(R(0.5)) * (xx * xx + yy * yy + zz * zz) + (a.xy * a.xy + a.xz * a.xz + a.yz * a.yz);
  const T size = sqrt(half_square * T(R(1) / R(3)));
  const T scale = one / max(size, T(R(1.0e-30)));
  const Sym3<T> s = scale * Sym3<T>{xx, yy, zz, a.xy, a.xz, a.yz};
  const T determinant =
      s.xx * (s.yy * s.zz - s.yz * s.yz) - s.xy * (s.xy * s.zz - s.yz * s.xz) + s.xz * (s.xy * s.yz - s.yy * s.xz);
  const T y = sqrt(min(max(T(R(0.5)) + T(R(0.25)) * determinant, T(R(0))), one));
  T u = y * (T(R(1.1547005)) - T(R(0.1547005)) * y);
  constexpr int kSteps = sizeof(R) == 4 ? 2 : 3;
  for (int step = 0; step < kSteps; ++step)
    u -= two * (u * (T(R(3)) + u) - two * y * sqrt(T(R(3)) + u)) / (T(R(6)) + T(R(3)) * u);
  return mean + size * (one + u);
}

}  // namespace breccia::material

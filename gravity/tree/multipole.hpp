// Taylor expansions of the softened potential g(r) = 1/sqrt(r^2 + eps^2), in the unit system G = 1. Everything derives
// from q = g(r) alone: the derivatives of the softened law are those of 1/r with q in place of 1/r, only not traceless,
// so sources keep their full second moment S = sum m d d^T and local expansions their full symmetric tensors.
//
// psi = sum m g is minus the potential and its gradient is the acceleration. T is float, double or a Pack.
#pragma once

#include "breccia/linalg.hpp"
#include "breccia/macros.hpp"

namespace breccia::gravity {

/// Symmetric tensors of rank three and four.
template <class T>
struct Rank3 {
  T xxx, xxy, xxz, xyy, xyz, xzz, yyy, yyz, yzz, zzz;
};
template <class T>
struct Rank4 {
  T xxxx, xxxy, xxxz, xxyy, xxyz, xxzz, xyyy, xyyz, xyzz, xzzz, yyyy, yyyz, yyzz, yzzz, zzzz;
};

/// psi(c + r) = value + d1.r + 1/2 d2:rr + 1/6 d3:rrr + 1/24 d4:rrrr around a centre c.
template <class T>
struct LocalExpansion {
  T value;
  Vec3<T> d1;
  Sym3<T> d2;
  Rank3<T> d3;
  Rank4<T> d4;
};
inline constexpr int kLocalCoefficients = 1 + 3 + 6 + 10 + 15;

/// A cell of masses seen from outside: total mass and second moment about its centre of mass.
template <class T>
struct Moments {
  T mass;
  Sym3<T> second;
};

/// psi and its gradient at one point.
template <class T>
struct PointField {
  T value;
  Vec3<T> gradient;
};

template <class T>
BRECCIA_HD T contract(Vec3<T> a, Vec3<T> r) {
  return dot(a, r);
}
template <class T>
BRECCIA_HD Vec3<T> contract(const Sym3<T>& a, Vec3<T> r) {
  return {a.xx * r.x + a.xy * r.y + a.xz * r.z, a.xy * r.x + a.yy * r.y + a.yz * r.z,
          a.xz * r.x + a.yz * r.y + a.zz * r.z};
}
template <class T>
BRECCIA_HD Sym3<T> contract(const Rank3<T>& a, Vec3<T> r) {
  return {a.xxx * r.x + a.xxy * r.y + a.xxz * r.z, a.xyy * r.x + a.yyy * r.y + a.yyz * r.z,
          a.xzz * r.x + a.yzz * r.y + a.zzz * r.z, a.xxy * r.x + a.xyy * r.y + a.xyz * r.z,
          a.xxz * r.x + a.xyz * r.y + a.xzz * r.z, a.xyz * r.x + a.yyz * r.y + a.yzz * r.z};
}
template <class T>
BRECCIA_HD Rank3<T> contract(const Rank4<T>& a, Vec3<T> r) {
  return {a.xxxx * r.x + a.xxxy * r.y + a.xxxz * r.z, a.xxxy * r.x + a.xxyy * r.y + a.xxyz * r.z,
          a.xxxz * r.x + a.xxyz * r.y + a.xxzz * r.z, a.xxyy * r.x + a.xyyy * r.y + a.xyyz * r.z,
          a.xxyz * r.x + a.xyyz * r.y + a.xyzz * r.z, a.xxzz * r.x + a.xyzz * r.y + a.xzzz * r.z,
          a.xyyy * r.x + a.yyyy * r.y + a.yyyz * r.z, a.xyyz * r.x + a.yyyz * r.y + a.yyzz * r.z,
          a.xyzz * r.x + a.yyzz * r.y + a.yzzz * r.z, a.xzzz * r.x + a.yzzz * r.y + a.zzzz * r.z};
}

template <class T>
BRECCIA_HD Rank3<T> operator+(const Rank3<T>& a, const Rank3<T>& b) {
  return {a.xxx + b.xxx, a.xxy + b.xxy, a.xxz + b.xxz, a.xyy + b.xyy, a.xyz + b.xyz,
          a.xzz + b.xzz, a.yyy + b.yyy, a.yyz + b.yyz, a.yzz + b.yzz, a.zzz + b.zzz};
}

/// psi and gradient at `r` from the centre of the expansion (L2P).
template <class T>
BRECCIA_HD PointField<T> evaluate(const LocalExpansion<T>& l, Vec3<T> r) {
  const T half(0.5F);
  const T sixth = T(1.0F) / T(6.0F);
  const Rank3<T> u3 = contract(l.d4, r);
  const Sym3<T> u2 = contract(u3, r);
  const Vec3<T> u1 = contract(u2, r);
  const Sym3<T> v2 = contract(l.d3, r);
  const Vec3<T> v1 = contract(v2, r);
  const Vec3<T> w1 = contract(l.d2, r);
  return {l.value + dot(l.d1, r) + half * dot(w1, r) + sixth * (dot(v1, r) + T(0.25F) * dot(u1, r)),
          l.d1 + w1 + half * v1 + sixth * u1};
}

/// The same polynomial about a centre moved by `r` (L2L); exact.
template <class T>
BRECCIA_HD LocalExpansion<T> shifted(const LocalExpansion<T>& l, Vec3<T> r) {
  const PointField<T> field = evaluate(l, r);
  const Rank3<T> u3 = contract(l.d4, r);
  return {field.value, field.gradient, l.d2 + contract(l.d3, r) + T(0.5F) * contract(u3, r), l.d3 + u3, l.d4};
}

/// What the derivatives of g share: a second moment seen along x = target - source, and powers of q.
template <class T>
struct SourceView {
  T q3, c3, c15;  ///< q^3, 3 q^5, 15 q^7
  T c105;         ///< 105 q^9
  Vec3<T> s;      ///< S x
  T xsx, trace;   ///< x.S x and the trace of S
};
template <class T>
BRECCIA_HD SourceView<T> view(const Moments<T>& source, Vec3<T> x, T q) {
  const T q2 = q * q;
  const T q3 = q * q2;
  const T c3 = T(3.0F) * (q3 * q2);
  const T c15 = T(5.0F) * (c3 * q2);
  const Vec3<T> s = contract(source.second, x);
  return {q3, c3, c15, T(7.0F) * (c15 * q2), s, dot(x, s), source.second.xx + source.second.yy + source.second.zz};
}

/// Field of a cell at x = target - centre of mass, q = g(x) (M2P): monopole and quadrupole.
template <class T>
BRECCIA_HD PointField<T> field_of(const Moments<T>& source, Vec3<T> x, T q) {
  const SourceView<T> v = view(source, x, q);
  const T half(0.5F);
  const T along = half * (v.c3 * v.trace - v.c15 * v.xsx) - source.mass * v.q3;
  return {source.mass * q + half * (v.c3 * v.xsx - v.q3 * v.trace), along * x + v.c3 * v.s};
}

/// Adds a cell's field to the expansion about a centre x from it (M2L), all terms up to the fourth derivative of g.
template <class T>
BRECCIA_HD void add_field_of(const Moments<T>& source, Vec3<T> x, T q, LocalExpansion<T>& l) {
  const SourceView<T> v = view(source, x, q);
  const T half(0.5F);
  const Sym3<T>& m2 = source.second;
  l.value += source.mass * q + half * (v.c3 * v.xsx - v.q3 * v.trace);

  const T shape = half * (v.c3 * v.trace - v.c15 * v.xsx) - source.mass * v.q3;
  l.d1 += shape * x + v.c3 * v.s;

  const T xx = x.x * x.x, yy = x.y * x.y, zz = x.z * x.z, xy = x.x * x.y, xz = x.x * x.z, yz = x.y * x.z;
  const T outer = source.mass * v.c3 + half * (v.c105 * v.xsx - v.c15 * v.trace);
  l.d2.xx += outer * xx - (v.c15 + v.c15) * (x.x * v.s.x) + v.c3 * m2.xx + shape;
  l.d2.yy += outer * yy - (v.c15 + v.c15) * (x.y * v.s.y) + v.c3 * m2.yy + shape;
  l.d2.zz += outer * zz - (v.c15 + v.c15) * (x.z * v.s.z) + v.c3 * m2.zz + shape;
  l.d2.xy += outer * xy - v.c15 * (x.x * v.s.y + x.y * v.s.x) + v.c3 * m2.xy;
  l.d2.xz += outer * xz - v.c15 * (x.x * v.s.z + x.z * v.s.x) + v.c3 * m2.xz;
  l.d2.yz += outer * yz - v.c15 * (x.y * v.s.z + x.z * v.s.y) + v.c3 * m2.yz;

  const T three(3.0F);
  const T a3 = source.mass * v.c3;
  const T a15 = source.mass * v.c15;
  const T a105 = source.mass * v.c105;
  l.d3.xxx += x.x * (three * a3 - a15 * xx);
  l.d3.xxy += x.y * (a3 - a15 * xx);
  l.d3.xxz += x.z * (a3 - a15 * xx);
  l.d3.xyy += x.x * (a3 - a15 * yy);
  l.d3.xyz -= a15 * (xy * x.z);
  l.d3.xzz += x.x * (a3 - a15 * zz);
  l.d3.yyy += x.y * (three * a3 - a15 * yy);
  l.d3.yyz += x.z * (a3 - a15 * yy);
  l.d3.yzz += x.y * (a3 - a15 * zz);
  l.d3.zzz += x.z * (three * a3 - a15 * zz);

  const T a45 = three * a15;
  const T a9 = three * a3;
  l.d4.xxxx += xx * (a105 * xx - (a45 + a45)) + a9;
  l.d4.xxxy += xy * (a105 * xx - a45);
  l.d4.xxxz += xz * (a105 * xx - a45);
  l.d4.xxyy += a105 * (xx * yy) - a15 * (xx + yy) + a3;
  l.d4.xxyz += yz * (a105 * xx - a15);
  l.d4.xxzz += a105 * (xx * zz) - a15 * (xx + zz) + a3;
  l.d4.xyyy += xy * (a105 * yy - a45);
  l.d4.xyyz += xz * (a105 * yy - a15);
  l.d4.xyzz += xy * (a105 * zz - a15);
  l.d4.xzzz += xz * (a105 * zz - a45);
  l.d4.yyyy += yy * (a105 * yy - (a45 + a45)) + a9;
  l.d4.yyyz += yz * (a105 * yy - a45);
  l.d4.yyzz += a105 * (yy * zz) - a15 * (yy + zz) + a3;
  l.d4.yzzz += yz * (a105 * zz - a45);
  l.d4.zzzz += zz * (a105 * zz - (a45 + a45)) + a9;
}

/// Calls f on each pair of coefficients of two expansions.
template <class A, class B, class F>
BRECCIA_HD void for_each_coefficient(LocalExpansion<A>& a, const LocalExpansion<B>& b, F f) {
  f(a.value, b.value);
  f(a.d1.x, b.d1.x), f(a.d1.y, b.d1.y), f(a.d1.z, b.d1.z);
  f(a.d2.xx, b.d2.xx), f(a.d2.yy, b.d2.yy), f(a.d2.zz, b.d2.zz);
  f(a.d2.xy, b.d2.xy), f(a.d2.xz, b.d2.xz), f(a.d2.yz, b.d2.yz);
  f(a.d3.xxx, b.d3.xxx), f(a.d3.xxy, b.d3.xxy), f(a.d3.xxz, b.d3.xxz), f(a.d3.xyy, b.d3.xyy);
  f(a.d3.xyz, b.d3.xyz), f(a.d3.xzz, b.d3.xzz), f(a.d3.yyy, b.d3.yyy), f(a.d3.yyz, b.d3.yyz);
  f(a.d3.yzz, b.d3.yzz), f(a.d3.zzz, b.d3.zzz);
  f(a.d4.xxxx, b.d4.xxxx), f(a.d4.xxxy, b.d4.xxxy), f(a.d4.xxxz, b.d4.xxxz), f(a.d4.xxyy, b.d4.xxyy);
  f(a.d4.xxyz, b.d4.xxyz), f(a.d4.xxzz, b.d4.xxzz), f(a.d4.xyyy, b.d4.xyyy), f(a.d4.xyyz, b.d4.xyyz);
  f(a.d4.xyzz, b.d4.xyzz), f(a.d4.xzzz, b.d4.xzzz), f(a.d4.yyyy, b.d4.yyyy), f(a.d4.yyyz, b.d4.yyyz);
  f(a.d4.yyzz, b.d4.yyzz), f(a.d4.yzzz, b.d4.yzzz), f(a.d4.zzzz, b.d4.zzzz);
}

}  // namespace breccia::gravity

// Small vectors and 3x3 tensors over any scalar type T (float, double, Pack).
#pragma once

#include "breccia/macros.hpp"

namespace breccia {

template <class T>
struct Vec3 {
  T x, y, z;
  friend BRECCIA_HD Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend BRECCIA_HD Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend BRECCIA_HD Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
  friend BRECCIA_HD Vec3 operator*(T s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
  friend BRECCIA_HD Vec3 operator*(Vec3 a, T s) { return {s * a.x, s * a.y, s * a.z}; }
  BRECCIA_HD Vec3& operator+=(Vec3 b) { return *this = *this + b; }
  BRECCIA_HD Vec3& operator-=(Vec3 b) { return *this = *this - b; }
};
using Vec3d = Vec3<double>;

template <class T>
BRECCIA_HD T dot(Vec3<T> a, Vec3<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
BRECCIA_HD Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// General 3x3 tensor, row by row: xy is row x, column y.
template <class T>
struct Mat3 {
  T xx, xy, xz, yx, yy, yz, zx, zy, zz;
};

/// Symmetric 3x3 tensor.
template <class T>
struct Sym3 {
  T xx, yy, zz, xy, xz, yz;
  friend BRECCIA_HD Sym3 operator+(Sym3 a, Sym3 b) {
    return {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz};
  }
  friend BRECCIA_HD Sym3 operator*(T s, Sym3 a) { return {s * a.xx, s * a.yy, s * a.zz, s * a.xy, s * a.xz, s * a.yz}; }
};

/// Symmetric and traceless 3x3 tensor: zz = -(xx + yy).
template <class T>
struct Dev3 {
  T xx, yy, xy, xz, yz;
  BRECCIA_HD T zz() const { return -(xx + yy); }
  friend BRECCIA_HD Dev3 operator+(Dev3 a, Dev3 b) {
    return {a.xx + b.xx, a.yy + b.yy, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz};
  }
  friend BRECCIA_HD Dev3 operator*(T s, Dev3 a) { return {s * a.xx, s * a.yy, s * a.xy, s * a.xz, s * a.yz}; }
};

template <class T>
BRECCIA_HD T trace(const Mat3<T>& a) {
  return a.xx + a.yy + a.zz;
}
/// Symmetric part of a general tensor.
template <class T>
BRECCIA_HD Sym3<T> symmetric_part(const Mat3<T>& a) {
  const T half(0.5F);
  return {a.xx, a.yy, a.zz, half * (a.xy + a.yx), half * (a.xz + a.zx), half * (a.yz + a.zy)};
}
/// a : b
template <class T>
BRECCIA_HD T contract(const Sym3<T>& a, const Sym3<T>& b) {
  const T two(2.0F);
  return a.xx * b.xx + a.yy * b.yy + a.zz * b.zz + two * (a.xy * b.xy + a.xz * b.xz + a.yz * b.yz);
}
template <class T>
BRECCIA_HD T determinant(const Mat3<T>& a) {
  return a.xx * (a.yy * a.zz - a.yz * a.zy) - a.xy * (a.yx * a.zz - a.yz * a.zx) + a.xz * (a.yx * a.zy - a.yy * a.zx);
}
template <class T>
BRECCIA_HD T determinant(const Dev3<T>& a) {
  const T two(2.0F);
  return a.xx * (a.yy * a.zz() - a.yz * a.yz) + two * a.xy * a.xz * a.yz - a.xy * a.xy * a.zz() - a.xz * a.xz * a.yy;
}

}  // namespace breccia

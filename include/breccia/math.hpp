// Scalar twins of the pack operations, so that physics templated on T compiles for float and double too.
#pragma once

#include <cmath>

#include "breccia/macros.hpp"

namespace breccia {

BRECCIA_HD double select(bool m, double a, double b) { return m ? a : b; }
BRECCIA_HD float select(bool m, float a, float b) { return m ? a : b; }
BRECCIA_HD double min(double a, double b) { return a < b ? a : b; }
BRECCIA_HD float min(float a, float b) { return a < b ? a : b; }
BRECCIA_HD double max(double a, double b) { return a > b ? a : b; }
BRECCIA_HD float max(float a, float b) { return a > b ? a : b; }
BRECCIA_HD double abs(double a) { return a < 0 ? -a : a; }
BRECCIA_HD float abs(float a) { return a < 0 ? -a : a; }
BRECCIA_HD double sqrt(double a) { return ::sqrt(a); }
BRECCIA_HD float sqrt(float a) { return ::sqrtf(a); }
/// 1 / a, to an ulp or two where the processor has a faster way than dividing; `a` normal and below 2^126.
BRECCIA_HD double reciprocal(double a) { return 1.0 / a; }
BRECCIA_HD float reciprocal(float a) { return 1.0F / a; }
BRECCIA_HD bool any(bool m) { return m; }

/// The scalar type under T: itself for float and double, the lane type for packs.
template <class T>
struct ScalarOf {
  using type = typename T::Scalar;
};
template <>
struct ScalarOf<float> {
  using type = float;
};
template <>
struct ScalarOf<double> {
  using type = double;
};
template <class T>
using scalar_of = typename ScalarOf<T>::type;

/// Running sum that keeps increments far below its own rounding (physics.md 4: volume and energy need it).
/// Two scalars (about 48 bits) over float, one over double.
template <class T, class S = scalar_of<T>>
struct Accumulator;

template <class T>
struct Accumulator<T, float> {
  T high, low;
  BRECCIA_HD void add(T x) {
    // Knuth two-sum with the carried remainder; exact for any order of magnitudes.
    const T y = x + low;
    const T s = high + y;
    const T b = s - high;
    low = (high - (s - b)) + (y - b);
    high = s;
  }
  BRECCIA_HD T value() const { return high; }
  BRECCIA_HD void set(T x) {
    high = x;
    low = T(0.0F);
  }
};

template <class T>
struct Accumulator<T, double> {
  T high;
  BRECCIA_HD void add(T x) { high = high + x; }
  BRECCIA_HD T value() const { return high; }
  BRECCIA_HD void set(T x) { high = x; }
};

}  // namespace breccia

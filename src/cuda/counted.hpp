// A number that counts what is done with it: the cost of a physics function, from its own source.
#pragma once

#include "breccia/math.hpp"

namespace breccia::cuda {

struct Counted {
  using Scalar = float;
  static inline long operations = 0;

  float value = 0.0F;

  Counted() = default;
  Counted(float v) : value(v) {}  // a plain number takes part in arithmetic

  static Counted did(float result, long count = 1) {
    operations += count;
    return Counted(result);
  }
  friend Counted operator+(Counted a, Counted b) { return did(a.value + b.value); }
  friend Counted operator-(Counted a, Counted b) { return did(a.value - b.value); }
  friend Counted operator*(Counted a, Counted b) { return did(a.value * b.value); }
  friend Counted operator/(Counted a, Counted b) { return did(a.value / b.value); }
  friend Counted operator-(Counted a) { return Counted(-a.value); }
  Counted& operator+=(Counted b) { return *this = *this + b; }
  Counted& operator-=(Counted b) { return *this = *this - b; }
  friend bool operator<(Counted a, Counted b) { return did(a.value).value < b.value; }
  friend bool operator<=(Counted a, Counted b) { return did(a.value).value <= b.value; }
  friend bool operator>(Counted a, Counted b) { return did(a.value).value > b.value; }
  friend bool operator>=(Counted a, Counted b) { return did(a.value).value >= b.value; }
  friend bool operator==(Counted a, Counted b) { return did(a.value).value == b.value; }

  friend Counted select(bool m, Counted a, Counted b) { return did(m ? a.value : b.value); }
  friend Counted min(Counted a, Counted b) { return a < b ? a : b; }
  friend Counted max(Counted a, Counted b) { return a > b ? a : b; }
  friend Counted abs(Counted a) { return Counted(a.value < 0 ? -a.value : a.value); }
  friend Counted sqrt(Counted a) { return did(breccia::sqrt(a.value)); }
  friend Counted reciprocal(Counted a) { return did(breccia::reciprocal(a.value)); }
};

// Elementary functions by their series: about thirty operations each.
inline Counted exp(Counted a) { return Counted::did(::expf(a.value), 30); }
inline Counted log(Counted a) { return Counted::did(::logf(a.value), 30); }
inline Counted log1p(Counted a) { return Counted::did(::log1pf(a.value), 34); }
inline Counted cbrt(Counted a) { return Counted::did(::cbrtf(a.value), 66); }

}  // namespace breccia::cuda

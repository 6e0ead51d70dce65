// Triangular-shaped clouds and differences on a mesh, for any scalar or pack T over Real, on host and device.
#pragma once

#include "breccia/macros.hpp"

namespace breccia::gravity {

/// Weight of the node nearest to a particle at distance d from it [cells].
template <class Real, class T>
BRECCIA_HD T tsc_nearest(T d) {
  return T(Real(0.75)) - d * d;
}
/// Weight of the node next to that one on the side where d is positive; of the other one: of -d.
template <class Real, class T>
BRECCIA_HD T tsc_beside(T d) {
  const T half(Real(0.5));
  return half * (half + d) * (half + d);
}

/// Minus the derivative from the differences f(-k) - f(k) at k = 1, 2, 3 nodes, exact for polynomials up to degree 6.
template <class Real, class T>
BRECCIA_HD T minus_derivative(T one, T two, T three) {
  return T(Real(0.75)) * one - T(Real(0.15)) * two + T(Real(1.0 / 60.0)) * three;
}

}  // namespace breccia::gravity

// The law of a pair of particles, for any scalar or pack T, on host and device.
#pragma once

#include "breccia/macros.hpp"

namespace breccia::gravity {

/// Square of the distance below which two particles without softening count as one: q^3 must stay finite.
template <class Real>
inline constexpr Real kCoincidentPair = sizeof(Real) == 4 ? Real(1e-24) : Real(1e-100);

/// What a pair adds per unit of source mass: acceleration `force` d, potential -`depth`; d = source - target.
template <class T>
struct PairWeight {
  T force;
  T depth;
};

/// Newton's law softened after Plummer, q = 1/sqrt(d^2 + softening^2).
template <class T>
BRECCIA_HD PairWeight<T> newton_pair(T q) {
  return {q * (q * q), q};
}

}  // namespace breccia::gravity

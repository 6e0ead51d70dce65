// The law of a pair of particles, for any scalar or pack T, on host and device.
#pragma once

#include "breccia/macros.hpp"

namespace breccia::gravity {

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

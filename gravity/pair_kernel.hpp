// The inner loop of direct summation, compiled once per instruction set. No containers here: see breccia_add_kernels.
#pragma once

#include <cstdint>

namespace breccia::gravity {

/// Point masses, one array per component (gravity/points.hpp).
template <class Real>
struct PointArrays {
  const Real* high[3];
  const Real* low[3];  ///< what the float coordinate lacks; not read for double
  const Real* mass;    ///< in the caller's unit
  std::int64_t count;
};

/// Targets [begin, end) against all sources. Sums over the sources j, in units of G times the mass unit:
///   acceleration += m_j d q^3,  potential -= m_j q,  q = 1/sqrt(d^2 + softening^2),  d = x_j - x_i.
template <class Real>
struct PairTask {
  PointArrays<Real> targets;
  std::int64_t begin, end;  ///< multiples of 16; the arrays reach up to `end`
  PointArrays<Real> sources;
  bool same;               ///< the sources are the targets: pair (i, i) is left out
  Real softening_squared;  ///< [m2]
  double* acceleration[3];
  double* potential;  ///< null: not wanted
};

namespace isa_v2 {
void sum_pairs(const PairTask<float>& task);
void sum_pairs(const PairTask<double>& task);
}  // namespace isa_v2
namespace isa_v3 {
void sum_pairs(const PairTask<float>& task);
void sum_pairs(const PairTask<double>& task);
}  // namespace isa_v3
namespace isa_v4 {
void sum_pairs(const PairTask<float>& task);
void sum_pairs(const PairTask<double>& task);
}  // namespace isa_v4

/// The copy this processor runs fastest (breccia::active_isa).
void sum_pairs(const PairTask<float>& task);
void sum_pairs(const PairTask<double>& task);

}  // namespace breccia::gravity

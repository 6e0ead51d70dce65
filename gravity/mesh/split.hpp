// The Gaussian split of the softened pair law (gravity.md 5.3): potential -1/rho = long + short, rho^2 = r^2 + eps^2,
//   long = -erf(rho / 2 rs) / rho on the mesh,  short = -erfc(rho / 2 rs) / rho from pairs with rho < cutoff.
// Both parts are functions of rho, so that the sum is Plummer's law for any eps; written in rho^2 the long part is
// smooth at r = 0 and no rougher than without softening: erf(rho/2rs)/rho is a sum of Gaussians in r.
#pragma once

#include "breccia/macros.hpp"

namespace breccia::gravity {

/// Lengths of the split, in any unit; all functions here use the same one.
struct GaussianSplit {
  double scale = 0.8;      ///< rs
  double cutoff = 3.6;     ///< of rho
  double softening = 0.0;  ///< Plummer length eps

  friend bool operator==(const GaussianSplit&, const GaussianSplit&) = default;
};

/// -erf(rho / 2 rs) / rho of the pair at distance r.
double long_range_potential(const GaussianSplit& split, double r);

/// What becomes that potential when smeared by a Gaussian exp(-smearing k^2) in Fourier space: every Gaussian of the
/// sum is made narrower by as much. Needs smearing < scale^2.
double unsmeared_long_range_potential(const GaussianSplit& split, double smearing, double r);

/// Square of the distance below which two particles without softening do not feel each other [cells^2]: coordinates
/// relative to clusters are not exact enough to tell such pairs from coincident ones.
template <class Real>
inline constexpr Real kCoincidentSquared = sizeof(Real) == 4 ? Real(1e-12) : Real(1e-26);

/// Coefficients of the short-range law: powers of t = 2 rho^2 / cutoff^2 - 1.
template <class Real>
struct ShortRange {
  static constexpr int kMaxDegree = 12;
  int degree;        ///< 8, 10 or 12
  bool counts_self;  ///< softened enough to count pairs at any distance, a particle with itself among them
  Real softening_squared;
  Real cutoff_squared;
  Real force[kMaxDegree + 1];      ///< of the long-range force over distance, P(rho^2)
  Real potential[kMaxDegree + 1];  ///< of minus the long-range potential, Q(rho^2)
};

/// Fits the polynomials of the lowest degree that leave an error below 2e-5 of the Newtonian force of the pair.
/// Throws UsageError where none does: the cutoff then exceeds about 7 scales.
template <class Real>
ShortRange<Real> fit_short_range(const GaussianSplit& split);

/// sum of coefficient[k] t^k.
template <int kDegree, class T, class Real>
BRECCIA_HD T polynomial(const Real* coefficient, T t) {
  T sum(coefficient[kDegree]);
  for (int k = kDegree - 1; k >= 0; --k) sum = sum * t + T(coefficient[k]);
  return sum;
}

/// The pair law inside the cutoff, for any scalar or pack T: with rho2 = rho^2 and q = 1/rho, the acceleration is
/// m d * force(), the potential -m * potential().
template <int kDegree, class T, class Real>
struct ShortRangePair {
  const ShortRange<Real>& law;
  T scale;

  BRECCIA_HD explicit ShortRangePair(const ShortRange<Real>& l) : law(l), scale(Real(2) / l.cutoff_squared) {}
  BRECCIA_HD T force(T rho2, T q) const {
    return q * q * q - polynomial<kDegree>(law.force, rho2 * scale - T(Real(1)));
  }
  BRECCIA_HD T potential(T rho2, T q) const {
    return q - polynomial<kDegree>(law.potential, rho2 * scale - T(Real(1)));
  }
};

}  // namespace breccia::gravity

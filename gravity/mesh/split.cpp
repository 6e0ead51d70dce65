#include "gravity/mesh/split.hpp"

#include <cmath>
#include <string>
#include <vector>

#include "breccia/constants.hpp"
#include "breccia/error.hpp"

namespace breccia::gravity {
namespace {

constexpr double kFitError = 2e-5;

// Long-range force over distance: (erf z - 2 z exp(-z^2)/sqrt(pi)) / rho^3, z = rho / 2 rs.
double long_range_force(const GaussianSplit& split, double rho) {
  const double z = 0.5 * rho / split.scale;
  if (z < 0.05) {
    // The first terms of the series; the next one is z^6/18 of the first.
    const double z2 = z * z;
    return (1.0 - z2 * (0.6 - z2 * 3.0 / 14.0)) / (6.0 * std::sqrt(kPi) * std::pow(split.scale, 3));
  }
  return (std::erf(z) - 2.0 * z / std::sqrt(kPi) * std::exp(-z * z)) / std::pow(rho, 3);
}

double minus_long_range_potential(const GaussianSplit& split, double rho) {
  const double z = 0.5 * rho / split.scale;
  return z < 1e-8 ? 1.0 / (std::sqrt(kPi) * split.scale) : std::erf(z) / rho;
}

// Powers of t in [-1, 1] of the polynomial that equals f(cutoff^2 (t + 1)/2) at the Chebyshev points.
template <class F>
std::vector<double> chebyshev_fit(int degree, double cutoff, const F& f) {
  const int points = degree + 1;
  std::vector<double> series(static_cast<std::size_t>(points), 0.0);
  for (int k = 0; k < points; ++k) {
    const double angle = kPi * (k + 0.5) / points;
    const double value = f(cutoff * std::sqrt(0.5 * (1.0 + std::cos(angle))));
    for (int j = 0; j < points; ++j) series[static_cast<std::size_t>(j)] += 2.0 / points * value * std::cos(j * angle);
  }
  series[0] *= 0.5;
  // Sum of series[j] T_j(t), with T_{j+1} = 2 t T_j - T_{j-1} in powers of t.
  const std::size_t n = series.size();
  std::vector<double> powers(n, 0.0), before(n, 0.0), here(n, 0.0);
  here[0] = 1.0;
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t k = 0; k < n; ++k) powers[k] += series[j] * here[k];
    std::vector<double> next(n, 0.0);
    for (std::size_t k = 0; k < n; ++k) next[k] = (k > 0 ? (j == 0 ? 1.0 : 2.0) * here[k - 1] : 0.0) - before[k];
    before = here;
    here = next;
  }
  return powers;
}

double value_at(const std::vector<double>& powers, double t) {
  double sum = 0.0;
  for (std::size_t k = powers.size(); k-- > 0;) sum = sum * t + powers[k];
  return sum;
}

// Largest error inside the cutoff relative to the Newtonian law, scaled by rho^power.
template <class F>
double largest_error(const std::vector<double>& powers, double cutoff, int power, const F& f) {
  double worst = 0.0;
  for (int k = 1; k <= 400; ++k) {
    const double rho = cutoff * k / 400.0;
    const double t = 2.0 * rho * rho / (cutoff * cutoff) - 1.0;
    worst = std::max(worst, std::abs(value_at(powers, t) - f(rho)) * std::pow(rho, power));
  }
  return worst;
}

}  // namespace

double long_range_potential(const GaussianSplit& split, double r) {
  return -minus_long_range_potential(split, std::hypot(r, split.softening));
}

// long = -2/sqrt(pi) int_0^{1/2rs} exp(-rho^2 t^2) dt, and exp(-r^2 t^2) is the smeared exp(-r^2 u^2), but for its
// amplitude, with 1/t^2 = 1/u^2 + 4 smearing. In terms of u the integral is that of a narrower split, of
// exp(-r^2 u^2 - eps^2 t^2); the difference of eps^2 t^2 to eps^2 u^2 is integrated here, the rest is known.
double unsmeared_long_range_potential(const GaussianSplit& split, double smearing, double r) {
  GaussianSplit narrow = split;
  narrow.scale = std::sqrt(split.scale * split.scale - smearing);
  const double end = 0.5 / narrow.scale;
  const double eps2 = split.softening * split.softening;
  const double rho2 = r * r + eps2;
  const auto difference = [&](double u) {
    const double u2 = u * u;
    return std::exp(-rho2 * u2) * std::expm1(eps2 * u2 * (4.0 * smearing * u2) / (1.0 + 4.0 * smearing * u2));
  };
  // Falls off as eps^2 smearing / r^5.
  if (eps2 == 0.0 || r > 32.0 * narrow.scale) return long_range_potential(narrow, r);
  // Simpson's rule; the integrand is smooth over 1/r, at least two intervals.
  constexpr int kIntervals = 64;
  const double step = end / kIntervals;
  double sum = difference(end);
  for (int k = 1; k < kIntervals; ++k) sum += (k % 2 == 1 ? 4.0 : 2.0) * difference(step * k);
  return long_range_potential(narrow, r) - 2.0 / std::sqrt(kPi) * sum * step / 3.0;
}

template <class Real>
ShortRange<Real> fit_short_range(const GaussianSplit& split) {
  const auto force = [&](double rho) { return long_range_force(split, rho); };
  const auto potential = [&](double rho) { return minus_long_range_potential(split, rho); };
  for (const int degree : {8, 10, 12}) {
    const std::vector<double> force_powers = chebyshev_fit(degree, split.cutoff, force);
    const std::vector<double> potential_powers = chebyshev_fit(degree, split.cutoff, potential);
    if (largest_error(force_powers, split.cutoff, 3, force) > kFitError) continue;
    ShortRange<Real> law{};
    law.degree = degree;
    law.softening_squared = static_cast<Real>(split.softening * split.softening);
    law.counts_self = law.softening_squared > kCoincidentSquared<Real>;
    law.cutoff_squared = static_cast<Real>(split.cutoff * split.cutoff);
    for (std::size_t k = 0; k < force_powers.size(); ++k) {
      law.force[k] = static_cast<Real>(force_powers[k]);
      law.potential[k] = static_cast<Real>(potential_powers[k]);
    }
    return law;
  }
  throw UsageError("gravity: the cutoff of " + std::to_string(split.cutoff / split.scale) +
                   " split scales is too long; at most 7 are supported");
}

template ShortRange<float> fit_short_range<float>(const GaussianSplit& split);
template ShortRange<double> fit_short_range<double>(const GaussianSplit& split);

}  // namespace breccia::gravity

// Sums over many particles that do not depend on their order or on how they are shared among ranks.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace breccia::sim {

/// N sums, each with what rounding has taken from it so far (Neumaier 1974): their error is a few units in the last
/// place of the sum of |terms|, for any number of terms.
template <std::size_t N>
class CompensatedSums {
 public:
  void add(std::size_t which, double term) {
    double& sum = parts_[which];
    const double next = sum + term;
    parts_[N + which] += std::abs(sum) >= std::abs(term) ? (sum - next) + term : (term - next) + sum;
    sum = next;
  }

  /// The sums and, behind them, what they lack: what ranks add up, each for itself.
  std::array<double, 2 * N>& parts() { return parts_; }

  [[nodiscard]] double operator[](std::size_t which) const { return parts_[which] + parts_[N + which]; }

 private:
  std::array<double, 2 * N> parts_{};
};

}  // namespace breccia::sim

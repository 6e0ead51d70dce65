#include "analysis/trimmed_extent.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace breccia::analysis {
namespace {

constexpr double kTrimmedAtEachEnd = 0.01;

// Halvings of an interval until its ends are neighbouring doubles, nearly.
constexpr int kHalvings = 60;

// Number of values below x on all ranks; `sorted` are this rank's.
std::uint64_t count_below(const std::vector<double>& sorted, double x, const mpi::Comm& comm) {
  const auto here = std::lower_bound(sorted.begin(), sorted.end(), x) - sorted.begin();
  return comm.sum(static_cast<std::uint64_t>(here));
}

// The value below which the part `fraction` of all values lies, by bisection: no rank needs the others' values.
double quantile(const std::vector<double>& sorted, double fraction, const mpi::Comm& comm) {
  constexpr double kFar = std::numeric_limits<double>::max();
  double low = comm.min(sorted.empty() ? kFar : sorted.front());
  double high = comm.max(sorted.empty() ? -kFar : sorted.back());
  const double wanted = fraction * static_cast<double>(comm.sum(static_cast<std::uint64_t>(sorted.size())));
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (low + high);
    (static_cast<double>(count_below(sorted, middle, comm)) < wanted ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

std::array<double, 3> trimmed_extent(std::span<const Vec3d> position, const std::array<Vec3d, 3>& axes,
                                     const mpi::Comm& comm) {
  std::array<double, 3> extent{};
  if (comm.sum(static_cast<std::uint64_t>(position.size())) == 0) return extent;
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<double> along;
    along.reserve(position.size());
    for (const Vec3d p : position) along.push_back(dot(p, axes[k]));
    std::sort(along.begin(), along.end());
    extent[k] = quantile(along, 1.0 - kTrimmedAtEachEnd, comm) - quantile(along, kTrimmedAtEachEnd, comm);
  }
  return extent;
}

}  // namespace breccia::analysis

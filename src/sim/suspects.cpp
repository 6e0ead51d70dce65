#include "sim/suspects.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace breccia::sim {
namespace {

constexpr std::size_t kFew = 5;
constexpr std::uint64_t kAtOnce = std::uint64_t{1} << 20;  // ids that the ranks compare at a time

bool finite(Vec3d v) { return std::isfinite(v.x + v.y + v.z); }

bool finite(const Mat3<double>& c) {
  return std::isfinite(c.xx + c.xy + c.xz + c.yx + c.yy + c.yz + c.zx + c.zy + c.zz);
}

}  // namespace

std::string missing_ids(std::span<const std::uint64_t> ids, std::uint64_t total, const mpi::Comm& comm) {
  std::vector<std::uint64_t> missing;
  std::uint64_t number = 0;
  for (std::uint64_t first = 0; first < total; first += kAtOnce) {
    std::vector<std::int32_t> found(std::min(kAtOnce, total - first));
    for (const std::uint64_t id : ids) {
      if (id >= first && id - first < found.size()) found[id - first] = 1;
    }
    comm.max(std::span<std::int32_t>(found));
    for (std::uint64_t n = 0; n < found.size(); ++n) {
      if (found[n] != 0) continue;
      ++number;
      if (missing.size() < kFew) missing.push_back(first + n);
    }
  }
  const std::string few = fmt::format("{}", fmt::join(missing, ", "));
  return number > missing.size() ? fmt::format("{} and {} others", few, number - missing.size()) : few;
}

std::optional<std::uint64_t> not_finite(const ParticleOutput& p, const mpi::Comm& comm) {
  std::uint64_t lowest = UINT64_MAX;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double energy = p.internal_energy.empty() ? 0.0 : p.internal_energy[i];
    const double volume_and_stress = p.density[i] + p.pressure[i] + (p.shear_stress.empty() ? 0.0 : p.shear_stress[i]);
    const bool good = finite(p.position[i]) && finite(p.velocity[i]) && finite(p.gradient[i]) &&
                      std::isfinite(energy) && std::isfinite(volume_and_stress);
    if (!good) lowest = std::min(lowest, p.id[i]);
  }
  lowest = comm.min(lowest);
  return lowest == UINT64_MAX ? std::nullopt : std::optional(lowest);
}

}  // namespace breccia::sim

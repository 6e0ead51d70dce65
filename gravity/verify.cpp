#include "gravity/verify.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "breccia/constants.hpp"
#include "breccia/random.hpp"
#include "gravity/evaluation.hpp"
#include "gravity/pair_kernel.hpp"
#include "gravity/points.hpp"

namespace breccia::gravity {
namespace {

constexpr std::uint32_t kSampleStream = 0x76657269;

// Adds what this rank's particles do to the targets, in units of G times the mass unit.
void add_own(const Points<double>& own, const Points<double>& targets, double softening, int threads,
             std::vector<double> (&sums)[3]) {
  const std::int64_t groups = padded(targets.arrays().count) / kTargetGroup;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (std::int64_t group = 0; group < groups; ++group) {
    sum_pairs(PairTask<double>{.targets = targets.arrays(),
                               .begin = group * kTargetGroup,
                               .end = (group + 1) * kTargetGroup,
                               .sources = own.arrays(),
                               .same = false,
                               .softening_squared = softening * softening,
                               .acceleration = {sums[0].data(), sums[1].data(), sums[2].data()},
                               .potential = nullptr});
  }
}

// Every particle is drawn with the same probability; which ones depends on their global numbers alone.
std::vector<std::int64_t> draw(std::size_t mine, std::int64_t count, const mpi::Comm& comm) {
  const std::uint64_t first = comm.exclusive_scan(mine);
  const auto all = static_cast<double>(comm.sum(static_cast<std::uint64_t>(mine)));
  const RandomStream random(0, kSampleStream);
  std::vector<std::int64_t> drawn;
  for (std::size_t i = 0; i < mine; ++i) {
    if (random.uniform(first + i)[0] * all < static_cast<double>(count)) drawn.push_back(static_cast<std::int64_t>(i));
  }
  return drawn;
}

double norm(Vec3d a) { return std::sqrt(dot(a, a)); }

struct Deviation {
  double error, size;
};

FieldErrors statistics(const std::vector<Deviation>& all) {
  FieldErrors result;
  result.targets = static_cast<std::int64_t>(all.size());
  if (all.empty()) return result;
  double mean = 0.0;
  for (const Deviation& d : all) mean += d.size;
  mean /= static_cast<double>(all.size());
  std::vector<double> relative;
  for (const Deviation& d : all) {
    relative.push_back(d.size > 0.0 ? d.error / d.size : 0.0);
    result.rms += relative.back() * relative.back();
    result.max = std::max(result.max, mean > 0.0 ? d.error / std::max(d.size, 0.1 * mean) : 0.0);
  }
  result.rms = std::sqrt(result.rms / static_cast<double>(all.size()));
  std::sort(relative.begin(), relative.end());
  result.median = relative[relative.size() / 2];
  result.p99 = relative[relative.size() * 99 / 100];
  return result;
}

}  // namespace

std::vector<Vec3d> direct_acceleration(ParticlesView particles, const std::vector<std::int64_t>& targets,
                                       double softening, const mpi::Comm& comm, int threads) {
  std::vector<Vec3d> here;
  for (const std::int64_t i : targets) here.push_back(particles.position[static_cast<std::size_t>(i)]);
  const std::vector<Vec3d> all = comm.allgather_arrays(std::span<const Vec3d>(here));
  const std::vector<double> no_mass(all.size(), 0.0);
  const double mass_unit = heaviest(particles.mass, comm);
  Points<double> own, everywhere;
  own.fill(particles, mass_unit);
  everywhere.fill({all, no_mass}, 1.0);
  std::vector<double> sums[3];
  for (auto& s : sums) s.assign(static_cast<std::size_t>(padded(static_cast<std::int64_t>(all.size()))), 0.0);
  add_own(own, everywhere, softening, threads, sums);
  for (auto& s : sums) comm.sum(std::span<double>(s));

  const auto first = static_cast<std::size_t>(comm.exclusive_scan(here.size()));
  const double unit = kGravitationalConstant * mass_unit;
  std::vector<Vec3d> result;
  for (std::size_t k = first; k < first + here.size(); ++k) {
    result.push_back(unit * Vec3d{sums[0][k], sums[1][k], sums[2][k]});
  }
  return result;
}

FieldErrors field_errors(std::span<const Vec3d> is, std::span<const Vec3d> should, const mpi::Comm& comm) {
  std::vector<Deviation> mine;
  for (std::size_t k = 0; k < is.size(); ++k) mine.push_back({norm(is[k] - should[k]), norm(should[k])});
  return statistics(comm.allgather_arrays(std::span<const Deviation>(mine)));
}

FieldErrors verify(ParticlesView particles, std::span<const Vec3d> acceleration, double softening, std::int64_t count,
                   const mpi::Comm& comm, int threads) {
  const std::vector<std::int64_t> targets = draw(particles.position.size(), count, comm);
  const std::vector<Vec3d> exact = direct_acceleration(particles, targets, softening, comm, threads);
  std::vector<Vec3d> is;
  for (const std::int64_t i : targets) is.push_back(acceleration[static_cast<std::size_t>(i)]);
  return field_errors(is, exact, comm);
}

}  // namespace breccia::gravity

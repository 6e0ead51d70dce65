#include "gravity/verify.hpp"

#include <algorithm>
#include <array>
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
template <class Real>
void add_own(const Points<Real>& own, const Points<Real>& targets, double softening, int threads,
             std::vector<double> (&sums)[3]) {
  const std::int64_t groups = padded(targets.arrays().count) / kTargetGroup;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (std::int64_t group = 0; group < groups; ++group) {
    sum_pairs(PairTask<Real>{.targets = targets.arrays(),
                             .begin = group * kTargetGroup,
                             .end = (group + 1) * kTargetGroup,
                             .sources = own.arrays(),
                             .same = false,
                             .softening_squared = static_cast<Real>(softening * softening),
                             .acceleration = {sums[0].data(), sums[1].data(), sums[2].data()},
                             .potential = nullptr});
  }
}

// The particles of all ranks whose flag is `wanted`, or only those of this one.
struct Part {
  std::vector<Vec3d> position;
  std::vector<double> mass;

  Part(ParticlesView particles, std::span<const char> flags, char wanted) {
    for (std::size_t i = 0; i < flags.size(); ++i) {
      if (flags[i] != wanted) continue;
      position.push_back(particles.position[i]);
      mass.push_back(particles.mass[i]);
    }
  }
  void gather(const mpi::Comm& comm) {
    position = comm.allgather_arrays(std::span<const Vec3d>(position));
    mass = comm.allgather_arrays(std::span<const double>(mass));
  }
};

Vec3d mean_of(std::array<double, 4> sums, const mpi::Comm& comm) {
  comm.sum(std::span<double>(sums));
  return (1.0 / sums[3]) * Vec3d{sums[0], sums[1], sums[2]};
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

Vec3d pull_on_body(ParticlesView particles, std::span<const char> in_body, double softening, const mpi::Comm& comm,
                   int threads) {
  const Part outside(particles, in_body, 0);
  Part body(particles, in_body, 1);
  body.gather(comm);
  const double mass_unit = heaviest(particles.mass, comm);
  Points<float> sources, targets;
  sources.fill({outside.position, outside.mass}, mass_unit);
  targets.fill({body.position, body.mass}, mass_unit);
  std::vector<double> sums[3];
  for (auto& s : sums) s.assign(static_cast<std::size_t>(padded(static_cast<std::int64_t>(body.mass.size()))), 0.0);
  add_own(sources, targets, softening, threads, sums);
  std::array<double, 4> of_body{};
  for (std::size_t i = 0; i < body.mass.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) of_body[k] += body.mass[i] * sums[k][i];
    of_body[3] += body.mass[i] / comm.size();
  }
  return kGravitationalConstant * mass_unit * mean_of(of_body, comm);
}

Vec3d mean_acceleration(ParticlesView particles, std::span<const char> in_body, std::span<const Vec3d> acceleration,
                        const mpi::Comm& comm) {
  std::array<double, 4> of_body{};
  for (std::size_t i = 0; i < in_body.size(); ++i) {
    if (in_body[i] == 0) continue;
    const double m = particles.mass[i];
    const double values[4] = {m * acceleration[i].x, m * acceleration[i].y, m * acceleration[i].z, m};
    for (std::size_t k = 0; k < 4; ++k) of_body[k] += values[k];
  }
  return mean_of(of_body, comm);
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

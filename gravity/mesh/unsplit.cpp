#include "gravity/mesh/unsplit.hpp"

#include <algorithm>
#include <vector>

#include "breccia/constants.hpp"
#include "gravity/pair_kernel.hpp"

namespace breccia::gravity {
namespace {

struct Subset {
  std::vector<std::size_t> index;
  std::vector<Vec3d> position;
  std::vector<double> mass;

  void add(ParticlesView particles, std::size_t i) {
    index.push_back(i);
    position.push_back(particles.position[i]);
    mass.push_back(particles.mass[i]);
  }
};

// Direct sums in double over all sources, those of set 0 among themselves included.
void add_pairs(const Subset& targets, const Subset& sources, bool same, const Parameters& parameters, double mass_unit,
               int threads, std::vector<double> (&sums)[4]) {
  Points<float> to, from;
  to.fill({targets.position, targets.mass}, mass_unit);
  from.fill({sources.position, sources.mass}, mass_unit);
  const std::int64_t groups = padded(static_cast<std::int64_t>(targets.index.size())) / kTargetGroup;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (std::int64_t group = 0; group < groups; ++group) {
    sum_pairs(PairTask<float>{.targets = to.arrays(),
                              .begin = group * kTargetGroup,
                              .end = (group + 1) * kTargetGroup,
                              .sources = from.arrays(),
                              .same = same,
                              .softening_squared = static_cast<float>(parameters.softening * parameters.softening),
                              .acceleration = {sums[0].data(), sums[1].data(), sums[2].data()},
                              .potential = sums[3].empty() ? nullptr : sums[3].data()});
  }
}

}  // namespace

void UnsplitField::add_to(ParticlesView particles, std::span<const std::uint8_t> set, int sets, double mass_unit,
                          std::span<Vec3d> acceleration, std::span<double> potential, Stats& stats) {
  std::vector<Subset> subsets(static_cast<std::size_t>(sets));
  for (std::size_t i = 0; i < set.size(); ++i) subsets[set[i]].add(particles, i);
  const double unit = kGravitationalConstant * mass_unit;
  for (std::size_t target = 0; target < subsets.size(); ++target) {
    const Subset& t = subsets[target];
    std::vector<double> sums[4];
    for (std::size_t c = 0; c < 4; ++c) {
      sums[c].assign(c < 3 || !potential.empty() ? static_cast<std::size_t>(padded(static_cast<std::int64_t>(t.index.size()))) : 0, 0.0);
    }
    for (std::size_t source = 0; source < subsets.size(); ++source) {
      if (source == target && target > 0) continue;
      const Subset& own = subsets[source];
      add_pairs(t, own, source == target, parameters_, mass_unit, threads_, sums);
      stats.pairs += static_cast<double>(t.index.size()) * static_cast<double>(own.index.size());
      if (comm_.size() == 1) continue;
      Subset others;
      const std::vector<std::int64_t> counts = comm_.allgather(static_cast<std::int64_t>(own.index.size()));
      const std::vector<Vec3d> all_positions = comm_.allgather_arrays<Vec3d>(own.position);
      const std::vector<double> all_masses = comm_.allgather_arrays<double>(own.mass);
      std::size_t at = 0;
      for (std::size_t r = 0; r < counts.size(); ++r) {
        for (std::int64_t i = 0; i < counts[r]; ++i, ++at) {
          if (static_cast<int>(r) != comm_.rank()) others.add({all_positions, all_masses}, at);
        }
      }
      add_pairs(t, others, false, parameters_, mass_unit, threads_, sums);
    }
    for (std::size_t k = 0; k < t.index.size(); ++k) {
      acceleration[t.index[k]] += unit * Vec3d{sums[0][k], sums[1][k], sums[2][k]};
      if (!potential.empty()) potential[t.index[k]] += unit * sums[3][k];
    }
  }
}

}  // namespace breccia::gravity

#include "gravity/mesh/unsplit.hpp"

#include <algorithm>
#include <cmath>

#include "breccia/constants.hpp"
#include "gravity/tree/scales.hpp"
#include "gravity/tree/tree_solver.hpp"

namespace breccia::gravity {
namespace {

struct Traveller {
  Vec3d position;
  double mass;
  std::uint8_t set;
};

// Only cells with particles of this rank are targets here.
void mark_targets(Tree& tree, const std::vector<std::int64_t>& owned) {
  std::vector<std::int32_t> before(owned.size() + 1, 0);
  for (std::size_t k = 0; k < owned.size(); ++k) {
    before[k + 1] = before[k] + (owned[static_cast<std::size_t>(tree.particles.order[k])] >= 0 ? 1 : 0);
  }
  for (Cell& cell : tree.cells) {
    cell.is_target = before[static_cast<std::size_t>(cell.end)] > before[static_cast<std::size_t>(cell.begin)];
  }
}

// Errors at a cell may also be weighed against what the whole of another set does there.
void raise_scales(const Tree& tree, const Tree& other, std::vector<double>& scales) {
  if (other.cells.empty()) return;
  const Cell& all = other.cells[0];
  for (std::size_t c = 0; c < scales.size(); ++c) {
    const Vec3d d = tree.cells[c].centre - all.centre;
    const double farthest = std::sqrt(dot(d, d)) + tree.cells[c].radius;
    // Inside the other set the pull of the whole says nothing.
    if (farthest > all.radius) scales[c] = std::max(scales[c], all.moments.mass / (farthest * farthest));
  }
}

}  // namespace

void UnsplitField::add_to(ParticlesView particles, std::span<const std::uint8_t> set, int sets, double mass_unit,
                          std::span<Vec3d> acceleration, std::span<double> potential, Stats& stats) {
  const bool outside = comm_.any(std::find(set.begin(), set.end(), std::uint8_t{0}) != set.end());
  if (!outside && sets <= 2) return;
  sets_.resize(static_cast<std::size_t>(sets));
  gather(particles, set, stats);
  grow_trees(mass_unit, !potential.empty());

  const double unit = kGravitationalConstant * mass_unit / root_.unit;
  for (std::size_t target = 0; target < sets_.size(); ++target) {
    walk_all(target, stats);
    const Set& s = sets_[target];
    for (std::size_t k = 0; k < s.owned.size(); ++k) {
      const std::int64_t owned = s.owned[static_cast<std::size_t>(s.tree.particles.order[k])];
      if (owned < 0) continue;
      const auto i = static_cast<std::size_t>(owned);
      acceleration[i] +=
          (unit / root_.unit) * Vec3d{s.sums.acceleration[0][k], s.sums.acceleration[1][k], s.sums.acceleration[2][k]};
      if (!potential.empty()) potential[i] += unit * s.sums.potential[k];
    }
  }
}

void UnsplitField::gather(ParticlesView particles, std::span<const std::uint8_t> set, Stats& stats) {
  for (Set& s : sets_) {
    s.position.clear();
    s.mass.clear();
    s.owned.clear();
  }
  const auto add = [&](const Traveller& t, std::int64_t owned) {
    Set& s = sets_[t.set];
    s.position.push_back(t.position);
    s.mass.push_back(t.mass);
    s.owned.push_back(owned);
  };
  std::vector<Traveller> own;
  for (std::size_t i = 0; i < set.size(); ++i) own.push_back({particles.position[i], particles.mass[i], set[i]});
  const std::vector<std::int64_t> counts = comm_.allgather(static_cast<std::int64_t>(own.size()));
  const std::vector<Traveller> all = comm_.size() > 1 ? comm_.allgather_arrays<Traveller>(own) : own;
  std::size_t at = 0;
  for (std::size_t r = 0; r < counts.size(); ++r) {
    for (std::int64_t i = 0; i < counts[r]; ++i) add(all[at++], static_cast<int>(r) == comm_.rank() ? i : -1);
  }
  stats.bytes_sent += static_cast<double>(own.size() * sizeof(Traveller)) * (comm_.size() - 1);

  Vec3d low = all.empty() ? Vec3d{} : all[0].position;
  Vec3d high = low;
  for (const Traveller& t : all) {
    low = {std::min(low.x, t.position.x), std::min(low.y, t.position.y), std::min(low.z, t.position.z)};
    high = {std::max(high.x, t.position.x), std::max(high.y, t.position.y), std::max(high.z, t.position.z)};
  }
  root_ = random_root(low, high);
}

void UnsplitField::grow_trees(double mass_unit, bool with_potential) {
  const mpi::Comm self(MPI_COMM_SELF);
  for (Set& s : sets_) {
    s.tree.sort(root_, {s.position, s.mass}, mass_unit, threads_);
    s.tree.build(threads_);
    // Before the targets are marked: the scales of a cell must not depend on which of its particles are here.
    s.scales = acceleration_scales(s.tree, parameters_.softening / root_.unit, threads_, self);
    mark_targets(s.tree, s.owned);
    s.sums.reset(s.tree.particles.size(), with_potential);
  }
  for (Set& s : sets_) {
    for (const Set& other : sets_) {
      if (&other != &s) raise_scales(s.tree, other.tree, s.scales);
    }
  }
}

void UnsplitField::walk_all(std::size_t target, Stats& stats) {
  Set& s = sets_[target];
  const WalkSettings settings{opening_for(parameters_), parameters_.softening / root_.unit, threads_};
  for (std::size_t source = 0; source < sets_.size(); ++source) {
    if (source == target && target > 0) continue;
    const Tree& from = sets_[source].tree;
    if (s.tree.cells.empty() || from.cells.empty() || !s.tree.cells[0].is_target) continue;
    const InteractionCounts counts = parameters_.precision == Precision::kMixed
                                         ? walk<float>(s.tree, s.scales, from, settings, s.sums)
                                         : walk<double>(s.tree, s.scales, from, settings, s.sums);
    stats.pairs += counts.pairs;
    stats.cell_interactions += counts.cells;
    stats.expansions += counts.expansions;
  }
}

}  // namespace breccia::gravity

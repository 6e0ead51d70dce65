#include "gravity/tree/unsplit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "breccia/constants.hpp"
#include "gravity/tree/essential.hpp"

namespace breccia::gravity {
namespace {

// Cube around the particles of all ranks.
Root common_root(ParticlesView particles, const mpi::Comm& comm) {
  constexpr double kFar = std::numeric_limits<double>::max();
  std::array<double, 6> extremes{};  // highest coordinates and the negative of the lowest
  extremes.fill(-kFar);
  for (const Vec3d& x : particles.position) {
    const double values[6] = {x.x, x.y, x.z, -x.x, -x.y, -x.z};
    for (std::size_t k = 0; k < 6; ++k) extremes[k] = std::max(extremes[k], values[k]);
  }
  comm.max(std::span<double>(extremes));
  const auto& e = extremes;
  return -e[3] <= e[0] ? random_root({-e[3], -e[4], -e[5]}, {e[0], e[1], e[2]}) : Root{};
}

}  // namespace

void UnsplitField::add_to(ParticlesView particles, std::span<const std::uint8_t> set, int sets, double mass_unit,
                          const FieldView& field, Stats& stats) {
  select(particles, set, sets);
  root_ = common_root(particles, comm_);
  const bool with_potential = comm_.any(!field.potential.empty());
  stats.phases.time(Phase::kSort, [&] { grow_trees(particles, mass_unit, with_potential); });
  stats.phases.time(Phase::kTree, [&] { weigh_cells(); });
  stats.phases.time(Phase::kExchange, [&] { import_sources(stats); });
  stats.phases.time(Phase::kTree, [&] {
    for (std::size_t target = 0; target < sets_.size(); ++target) walk_all(target, stats);
  });
  for (Set& s : sets_) write(s, mass_unit, field);
  for (const Set& s : sets_) stats.bytes_sent += s.tree->bytes_sent();
}

void UnsplitField::select(ParticlesView particles, std::span<const std::uint8_t> set, int sets) {
  sets_.resize(static_cast<std::size_t>(sets));
  for (Set& s : sets_) {
    s.position.clear();
    s.mass.clear();
    s.index.clear();
  }
  if (sets == 1) return;
  for (std::size_t i = 0; i < set.size(); ++i) {
    Set& s = sets_[set[i]];
    s.position.push_back(particles.position[i]);
    s.mass.push_back(particles.mass[i]);
    s.index.push_back(i);
  }
}

void UnsplitField::grow_trees(ParticlesView particles, double mass_unit, bool with_potential) {
  for (Set& s : sets_) {
    if (!s.tree) s.tree = std::make_unique<SharedTree>(comm_, threads_);
    s.tree->build(root_, sets_.size() == 1 ? particles : ParticlesView{s.position, s.mass}, mass_unit);
    s.sums.reset(s.tree->tree().particles.size(), with_potential);
  }
  std::int64_t all = 0;
  for (const Set& s : sets_) all += s.tree->tree().all_particles;
  opening_ = opening_for(parameters_, static_cast<double>(all));
}

void UnsplitField::weigh_cells() {
  double densest = 0.0;
  for (const Set& s : sets_) densest = std::max(densest, s.tree->largest_density());
  for (Set& s : sets_) {
    std::vector<Cell> others;
    for (const Set& other : sets_) {
      if (&other != &s && !other.tree->tree().cells.empty()) others.push_back(other.tree->tree().cell(0));
    }
    s.tree->set_scales(others, parameters_.softening / root_.unit, densest);
  }
}

void UnsplitField::import_sources(Stats& stats) {
  if (comm_.size() == 1) return;
  for (std::size_t source = 0; source < sets_.size(); ++source) {
    std::vector<const SharedTree*> targets;
    for (std::size_t target = 0; target < sets_.size(); ++target) {
      if (interact(target, source)) targets.push_back(sets_[target].tree.get());
    }
    const EssentialCount count = import_essential(*sets_[source].tree, targets, opening_, comm_);
    stats.bytes_sent += count.bytes_sent;
    stats.cells_imported += count.cells;
    stats.particles_imported += count.particles;
  }
}

void UnsplitField::walk_all(std::size_t target, Stats& stats) {
  Set& s = sets_[target];
  const WalkSettings settings{opening_, parameters_.softening / root_.unit, threads_};
  for (std::size_t source = 0; source < sets_.size(); ++source) {
    if (!interact(target, source)) continue;
    const Tree& from = sets_[source].tree->tree();
    const InteractionCounts counts = parameters_.precision == Precision::kMixed
                                         ? walk<float>(s.tree->tree(), s.tree->scales(), from, settings, s.sums)
                                         : walk<double>(s.tree->tree(), s.tree->scales(), from, settings, s.sums);
    stats.pairs += counts.pairs;
    stats.cell_interactions += counts.cells;
    stats.expansions += counts.expansions;
    stats.cells_missing += counts.missing;
  }
}

void UnsplitField::write(Set& s, double mass_unit, const FieldView& field) {
  const double potential_unit = kGravitationalConstant * mass_unit / root_.unit;
  const double unit = potential_unit / root_.unit;
  s.tree->deliver(s.sums, [&](std::size_t index, std::size_t k, const FieldSums& sums) {
    const std::size_t i = s.index.empty() ? index : s.index[index];
    field.acceleration[i] += unit * Vec3d{sums.acceleration[0][k], sums.acceleration[1][k], sums.acceleration[2][k]};
    if (!field.potential.empty()) field.potential[i] += potential_unit * sums.potential[k];
    if (!field.work.empty()) field.work[i] += sums.work[k];
  });
}

}  // namespace breccia::gravity

#include "cuda/unsplit_gravity.hpp"

#include "breccia/constants.hpp"
#include "gravity/mesh/box.hpp"

namespace breccia::cuda {

using gravity::Phase;

template <class Real>
void UnsplitGravity<Real>::add_field(std::span<const BodyArrays> sets, const Settings& settings, double* acceleration,
                                     gravity::Stats& stats) {
  const double softening = settings.softening / settings.root.unit;
  stats.phases.time(Phase::kSort, [&] {
    grow_trees(sets, settings);
    weigh_cells(softening);
  });
  stats.phases.time(Phase::kTree, [&] {
    walk_.clear_counts();
    const typename TreeGravity<Real>::Settings walking{
        .tolerance = settings.tolerance,
        .softening = softening,
        .first = settings.first,
        .own = settings.own,
        .unit = kGravitationalConstant * settings.mass_unit / (settings.root.unit * settings.root.unit)};
    for (std::size_t target = 0; target < sets.size(); ++target) {
      for (std::size_t source = 0; source < sets.size(); ++source) {
        if (!gravity::interact(target, source)) continue;
        walk_.add_field(*trees_[target], *trees_[source], walking, acceleration);
      }
    }
    const WalkCounts counts = walk_.counts();
    stats.pairs += static_cast<double>(counts.pairs);
    stats.cell_interactions += static_cast<double>(counts.cells);
    stats.expansions += static_cast<double>(counts.expansions);
  });
}

template <class Real>
void UnsplitGravity<Real>::grow_trees(std::span<const BodyArrays> sets, const Settings& settings) {
  while (trees_.size() < sets.size()) trees_.push_back(std::make_unique<DeviceTree>(comm_, stream_));
  trees_.resize(sets.size());
  for (std::size_t k = 0; k < sets.size(); ++k) {
    trees_[k]->build(sets[k], settings.root, settings.mass_unit, settings.first, settings.own);
  }
}

template <class Real>
void UnsplitGravity<Real>::weigh_cells(double softening) {
  for (const auto& tree : trees_) {
    OtherRoots others;
    for (const auto& other : trees_) {
      if (other != tree && !other->empty()) others.cell[others.count++] = other->view().cells;
    }
    tree->weigh(others, softening);
  }
}

template class UnsplitGravity<float>;
template class UnsplitGravity<double>;

}  // namespace breccia::cuda

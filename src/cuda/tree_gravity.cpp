#include "cuda/tree_gravity.hpp"

#include <utility>

namespace breccia::cuda {

template <class Real>
void TreeGravity<Real>::clear_counts() {
  counts_.reserve(1);
  counts_.fill_bytes(0, stream_);
}

template <class Real>
void TreeGravity<Real>::add_field(const DeviceTree& targets, const DeviceTree& sources, const Settings& settings,
                                  double* acceleration) {
  if (settings.own == 0 || targets.empty() || sources.empty()) return;
  Front* here = &fronts_[0];
  Front* next = &fronts_[1];
  start(*here);
  while (here->targets > 0) {
    WalkStep step = step_of(targets, sources, settings, *here);
    launch_divide(step, stream_);
    const unsigned leaves = place_candidates(step);
    launch_expand<Real>(step, stream_);
    sum_groups(step, leaves, targets, sources, settings, acceleration);
    descend(step, *next);
    candidates_.swap(lists_[kWhole].cell);
    std::swap(here, next);
  }
}

// The root is the first target and the first candidate.
template <class Real>
void TreeGravity<Real>::start(Front& front) {
  front.targets = front.pairs = 1;
  front.target.reserve(1);
  front.target.upload(std::vector<WalkTarget>{{0, 0, 0, 1, false}}, stream_);
  front.pair_first.reserve(2);
  front.pair_first.upload(std::vector<unsigned>{0, 1}, stream_);
  front.far.reserve(1);
  front.far.upload(std::vector<FarField>(1), stream_);
  candidates_.reserve(1);
  candidates_.upload(std::vector<std::int32_t>{0}, stream_);
}

template <class Real>
WalkStep TreeGravity<Real>::step_of(const DeviceTree& targets, const DeviceTree& sources, const Settings& settings,
                                    const Front& front) {
  WalkStep step;
  step.tree = targets.view();
  step.sources = sources.view();
  step.targets = front.targets;
  step.target = front.target.data();
  step.pair_first = front.pair_first.data();
  step.candidates = candidates_.data();
  step.pairs = front.pairs;
  step.tolerance = settings.tolerance;
  step.softening = settings.softening;
  step.far = front.far.data();
  step.counts = counts_.data();
  return step;
}

template <class Real>
unsigned TreeGravity<Real>::place_candidates(WalkStep& step) {
  for (int k = 0; k < kLists; ++k) {
    lists_[k].first.reserve(std::size_t{step.pairs} + 1);
    step.lists[k].first = lists_[k].first.data();
  }
  launch_count_pairs(step, stream_);
  for (List& list : lists_) exclusive_scan(list.first.data(), step.pairs + 1, scratch_, stream_);
  const auto total = [&](ListKind k) { return lists_[k].first.data() + step.pairs; };
  const auto entries = read_back<unsigned, kLists>({total(kExpanded), total(kWhole), total(kLeaves)}, stream_);
  for (int k = 0; k < kLists; ++k) {
    lists_[k].cell.reserve(entries[static_cast<std::size_t>(k)]);
    step.lists[k].cell = lists_[k].cell.data();
  }
  launch_list_pairs(step, stream_);
  return entries[kLeaves];
}

template <class Real>
void TreeGravity<Real>::sum_groups(const WalkStep& step, unsigned leaves, const DeviceTree& targets,
                                   const DeviceTree& sources, const Settings& settings, double* acceleration) {
  leaf_first_.reserve(std::size_t{leaves} + 1);
  launch_leaf_sizes(step, leaves, leaf_first_.data(), stream_);
  exclusive_scan(leaf_first_.data(), leaves + 1, scratch_, stream_);
  launch_sum_groups<Real>(step,
                          {.bodies = targets.bodies(),
                           .sources = sources.bodies(),
                           .leaf_first = leaf_first_.data(),
                           .first = settings.first,
                           .own = settings.own,
                           .unit = settings.unit,
                           .acceleration = acceleration},
                          stream_);
}

template <class Real>
void TreeGravity<Real>::descend(const WalkStep& step, Front& next) {
  child_first_.reserve(std::size_t{step.targets} + 1);
  child_pairs_.reserve(std::size_t{step.targets} + 1);
  Descent descent{.target_first = child_first_.data(), .pair_first = child_pairs_.data()};
  launch_count_descent(step, descent, stream_);
  exclusive_scan(child_first_.data(), step.targets + 1, scratch_, stream_);
  exclusive_scan(child_pairs_.data(), step.targets + 1, scratch_, stream_);
  const auto totals =
      read_back<unsigned, 2>({child_first_.data() + step.targets, child_pairs_.data() + step.targets}, stream_);
  next.targets = totals[0];
  next.pairs = totals[1];
  next.target.reserve(next.targets);
  next.pair_first.reserve(std::size_t{next.targets} + 1);
  next.far.reserve(next.targets);
  descent.target = next.target.data();
  descent.next_pair_first = next.pair_first.data();
  descent.far = next.far.data();
  launch_descend(step, descent, stream_);
}

template class TreeGravity<float>;
template class TreeGravity<double>;

}  // namespace breccia::cuda

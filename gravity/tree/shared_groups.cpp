// Groups of a shared tree that lie on several ranks: their particles go to one of them, and their field comes back.
#include <algorithm>

#include "gravity/tree/shared_tree.hpp"

namespace breccia::gravity {

// Sends the particles in leaves of other ranks there.
void SharedTree::gather_groups() {
  const SortedParticles& p = tree_.particles;
  std::vector<std::vector<Traveller>> to(static_cast<std::size_t>(comm_.size()));
  for (std::size_t n = 0; n < leaves_.size(); ++n) {
    const Cell& leaf = tree_.cell(leaves_[n].cell);
    if (leaves_[n].owner == comm_.rank()) continue;
    for (std::int64_t i = leaf.begin; i < leaf.end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      to[static_cast<std::size_t>(leaves_[n].owner)].push_back(
          {p.position(i), p.mass[k], p.key[k], p.order[k], static_cast<std::int32_t>(n), comm_.rank()});
    }
  }
  for (const auto& t : to) bytes_sent_ += static_cast<double>(t.size() * sizeof(Traveller));
  std::vector<std::vector<Traveller>> of_leaf(leaves_.size());
  for (const std::vector<Traveller>& from : comm_.alltoall(to)) {
    for (const Traveller& t : from) of_leaf[static_cast<std::size_t>(t.leaf)].push_back(t);
  }
  sort_by_leaves(of_leaf);
}

// Particles are left in the order of the leaves of this rank, with those that arrived, and of their keys.
void SharedTree::sort_by_leaves(std::vector<std::vector<Traveller>>& arrived) {
  const SortedParticles from = std::move(tree_.particles);
  SortedParticles& to = tree_.particles;
  to = {};
  std::vector<std::int32_t> home;
  const std::size_t n = from.key.size();
  for (auto* component : {&to.x, &to.y, &to.z, &to.mass}) component->reserve(n);
  const auto put = [&](Vec3d position, double mass, std::uint64_t key, std::int64_t index, std::int32_t rank) {
    to.append(position, mass);
    to.key.push_back(key);
    to.order.push_back(index);
    home.push_back(rank);
  };
  for (std::size_t l = 0; l < leaves_.size(); ++l) {
    Cell& leaf = tree_.cells[static_cast<std::size_t>(leaves_[l].cell)];
    const std::int32_t begin = leaf.begin, end = leaf.end;
    leaf.begin = static_cast<std::int32_t>(to.key.size());
    if (leaves_[l].owner == comm_.rank()) {
      std::vector<Traveller>& others = arrived[l];
      if (others.empty()) {
        for (std::int64_t i = begin; i < end; ++i) {
          const auto k = static_cast<std::size_t>(i);
          put(from.position(i), from.mass[k], from.key[k], from.order[k], comm_.rank());
        }
      } else {
        for (std::int64_t i = begin; i < end; ++i) {
          const auto k = static_cast<std::size_t>(i);
          others.push_back({from.position(i), from.mass[k], from.key[k], from.order[k], 0, comm_.rank()});
        }
        std::stable_sort(others.begin(), others.end(),
                         [](const Traveller& a, const Traveller& b) { return a.key < b.key; });
        for (const Traveller& t : others) put(t.position, t.mass, t.key, t.index, t.home);
      }
    }
    leaf.end = static_cast<std::int32_t>(to.key.size());
  }
  home_ = std::move(home);
  for (std::size_t i = tree_.cells.size(); i-- > 0;) {
    Cell& c = tree_.cells[i];
    if (c.children > 0) {
      c.begin = tree_.cell(c.first_child).begin;
      c.end = tree_.cell(c.first_child + c.children - 1).end;
    }
    c.is_target = c.end > c.begin;
  }
}

FieldSums SharedTree::bring_home(const FieldSums& sums, std::vector<std::int64_t>& index) {
  struct Result {
    std::int64_t index;
    Vec3d acceleration;
    double potential, work;
  };
  const bool with_potential = !sums.potential.empty();
  std::vector<std::vector<Result>> to(static_cast<std::size_t>(comm_.size()));
  for (std::size_t k = 0; k < home_.size(); ++k) {
    if (home_[k] == comm_.rank()) continue;
    const Vec3d a{sums.acceleration[0][k], sums.acceleration[1][k], sums.acceleration[2][k]};
    to[static_cast<std::size_t>(home_[k])].push_back(
        {tree_.particles.order[k], a, with_potential ? sums.potential[k] : 0.0, sums.work[k]});
  }
  for (const auto& t : to) bytes_sent_ += static_cast<double>(t.size() * sizeof(Result));
  FieldSums home;
  home.reset(0, with_potential);
  index.clear();
  for (const std::vector<Result>& from : comm_.alltoall(to)) {
    for (const Result& r : from) {
      index.push_back(r.index);
      home.acceleration[0].push_back(r.acceleration.x);
      home.acceleration[1].push_back(r.acceleration.y);
      home.acceleration[2].push_back(r.acceleration.z);
      home.potential.push_back(r.potential);
      home.work.push_back(r.work);
    }
  }
  return home;
}

}  // namespace breccia::gravity

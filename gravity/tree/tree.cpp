#include "gravity/tree/tree.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "breccia/random.hpp"

namespace breccia::gravity {
namespace {

constexpr std::uint32_t kRootStream = 0x67726176;

}  // namespace

Root random_root(Vec3d low, Vec3d high) {
  const Vec3d extent = high - low;
  const double largest = std::max({extent.x, extent.y, extent.z, 1e-3});
  Root root;
  root.side = 1.25 * largest;
  root.unit = std::exp2(std::floor(std::log2(root.side)) - 10.0);
  std::uint64_t seed = 0;
  for (const double c : {low.x, low.y, low.z, high.x, high.y, high.z}) {
    seed = std::rotl(seed, 11) ^ std::bit_cast<std::uint64_t>(c);
  }
  const RandomStream random(seed, kRootStream);
  const auto [a, b] = random.uniform(0);
  const auto [c, unused] = random.uniform(1);
  root.corner = low - Vec3d{a * (root.side - extent.x), b * (root.side - extent.y), c * (root.side - extent.z)};
  return root;
}

void Tree::sort(const Root& root, ParticlesView view, double mass_unit, int threads) {
  const std::size_t n = view.position.size();
  const double cells_per_unit = std::exp2(kKeyBitsPerAxis) * root.unit / root.side;
  keyed_.resize(n);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (std::size_t i = 0; i < n; ++i) {
    keyed_[i] = {morton_key(root.scaled(view.position[i]), cells_per_unit), static_cast<std::int64_t>(i)};
  }
  radix_sort(keyed_, scratch_, threads);

  SortedParticles& p = particles;
  for (auto* component : {&p.x, &p.y, &p.z, &p.mass}) component->resize(n);
  p.key.resize(n);
  p.order.resize(n);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (std::size_t i = 0; i < n; ++i) {
    const auto source = static_cast<std::size_t>(keyed_[i].index);
    const Vec3d scaled = root.scaled(view.position[source]);
    p.x[i] = scaled.x;
    p.y[i] = scaled.y;
    p.z[i] = scaled.z;
    p.mass[i] = view.mass[source] / mass_unit;
    p.key[i] = keyed_[i].key;
    p.order[i] = keyed_[i].index;
  }
}

void Tree::build(int threads) {
  cells.clear();
  all_particles = particles.size();
  if (all_particles == 0) return;
  Cell root;
  root.count = all_particles;
  root.end = static_cast<std::int32_t>(all_particles);
  cells.push_back(root);
  const std::int32_t frontier[1] = {0};
  grow(frontier, threads);
}

void Tree::grow(std::span<const std::int32_t> frontier, int threads) {
  struct Children {
    std::array<std::int32_t, kMostChildren + 1> bound;
    int count = 0;
    int key_bits = 0;
  };
  const auto split = [&](const Cell& c) {
    Children result;
    const auto& key = particles.key;
    const Split s =
        split_of(c.count, c.key_bits, key[static_cast<std::size_t>(c.begin)], key[static_cast<std::size_t>(c.end) - 1]);
    result.key_bits = s.start + s.bits;
    if (s.bits == 0) return result;
    result.bound[0] = c.begin;
    for (std::int32_t at = c.begin; at < c.end;) {
      const std::uint64_t here = prefix(key[static_cast<std::size_t>(at)], result.key_bits);
      const auto next = std::partition_point(key.begin() + at, key.begin() + c.end,
                                             [&](std::uint64_t k) { return prefix(k, result.key_bits) == here; });
      at = static_cast<std::int32_t>(next - key.begin());
      result.bound[static_cast<std::size_t>(++result.count)] = at;
    }
    return result;
  };

  std::vector<std::vector<std::int32_t>> levels{{frontier.begin(), frontier.end()}};
  std::vector<Children> children;
  while (!levels.back().empty()) {
    const std::vector<std::int32_t>& level = levels.back();
    children.resize(level.size());
#pragma omp parallel for num_threads(threads) schedule(static)
    for (std::size_t k = 0; k < level.size(); ++k) children[k] = split(cell(level[k]));
    std::vector<std::int32_t> next;
    for (std::size_t k = 0; k < level.size(); ++k) {
      Cell& parent = cells[static_cast<std::size_t>(level[k])];
      parent.first_child = static_cast<std::int32_t>(cells.size());
      parent.children = children[k].count;
      for (int c = 0; c < children[k].count; ++c) {
        Cell child;
        child.begin = children[k].bound[static_cast<std::size_t>(c)];
        child.end = children[k].bound[static_cast<std::size_t>(c) + 1];
        child.count = child.end - child.begin;
        child.key_bits = children[k].key_bits;
        next.push_back(static_cast<std::int32_t>(cells.size()));
        cells.push_back(child);
      }
    }
    levels.push_back(std::move(next));
  }
  for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
#pragma omp parallel for num_threads(threads) schedule(static)
    for (std::size_t k = 0; k < level->size(); ++k) set_moments(cells[static_cast<std::size_t>((*level)[k])]);
  }
}

std::vector<std::int32_t> Tree::groups() const {
  std::vector<std::int32_t> found, stack;
  if (!cells.empty()) stack.push_back(0);
  while (!stack.empty()) {
    const std::int32_t i = stack.back();
    const Cell& c = cell(i);
    stack.pop_back();
    if (c.is_group()) {
      found.push_back(i);
    } else {
      for (std::int32_t k = c.children; k-- > 0;) stack.push_back(c.first_child + k);
    }
  }
  return found;
}

void Tree::set_moments(Cell& c) const {
  if (c.is_leaf()) {
    set_leaf_moments(
        c, [&](std::int64_t i) { return particles.position(i); },
        [&](std::int64_t i) { return particles.mass[static_cast<std::size_t>(i)]; });
  } else {
    combine_children(c);
  }
  if (c.is_leaf() || c.count <= kExactRadius) c.radius = enclosing_radius(farthest_squared(c));
}

double Tree::farthest_squared(const Cell& c) const {
  double farthest = 0.0;
  for (std::int64_t i = c.begin; i < c.end; ++i) {
    const Vec3d d = particles.position(i) - c.centre;
    farthest = std::max(farthest, dot(d, d));
  }
  return farthest;
}

void Tree::combine_children(Cell& c) const { gravity::combine_children(c, children(c).data()); }

}  // namespace breccia::gravity

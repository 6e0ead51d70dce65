#include "analysis/local_friends.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>

namespace breccia::analysis {
namespace {

// Cells just small enough that any two particles of one cell are friends: only pairs of cells need a closer look.
// Friends then sit at most two cells apart.
constexpr double kCellsPerLink = 1.7321;
constexpr std::int64_t kReach = 2;

// So few pairs are tried one by one.
constexpr std::size_t kFewPairs = 64;

struct CellIndex {
  std::int64_t x, y, z;
  auto operator<=>(const CellIndex&) const = default;
};

using Point = std::array<double, 3>;

struct Box {
  Point low, high;
  [[nodiscard]] double extent(std::size_t axis) const { return high[axis] - low[axis]; }
  [[nodiscard]] std::size_t longest_axis() const {
    const std::size_t xy = extent(0) >= extent(1) ? 0 : 1;
    return extent(xy) >= extent(2) ? xy : 2;
  }
};

// Particles order[begin .. end) of one cell or of a part of it, and the box they fill.
struct Cluster {
  std::size_t begin, end;
  Box box;
  [[nodiscard]] std::size_t size() const { return end - begin; }
};

struct Cell {
  CellIndex index;
  Cluster members;
};

double nearest_squared(const Box& a, const Box& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double gap = std::max({a.low[k] - b.high[k], b.low[k] - a.high[k], 0.0});
    sum += gap * gap;
  }
  return sum;
}

double farthest_squared(const Box& a, const Box& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double span = std::max(a.high[k], b.high[k]) - std::min(a.low[k], b.low[k]);
    sum += span * span;
  }
  return sum;
}

Point point(Vec3d p) { return {p.x, p.y, p.z}; }

class Linker {
 public:
  Linker(std::span<const Vec3d> position, double link, FriendsCost& cost)
      : position_(position), link_squared_(link * link), cost_(cost), sets_(position.size()) {
    make_cells(link / kCellsPerLink);
  }

  UnionFind run() && {
    for (const Cell& cell : cells_) unite_members(cell);
    // Half of the neighbourhood, row by row: every pair of cells once.
    for (std::int64_t dx = 0; dx <= kReach; ++dx) {
      for (std::int64_t dy = dx == 0 ? 0 : -kReach; dy <= kReach; ++dy) sweep_row(dx, dy);
    }
    return std::move(sets_);
  }

 private:
  void make_cells(double side) {
    const std::size_t n = position_.size();
    std::vector<std::pair<CellIndex, std::size_t>> keyed(n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto cell = [side](double x) { return static_cast<std::int64_t>(std::floor(x / side)); };
      keyed[i] = {{cell(position_[i].x), cell(position_[i].y), cell(position_[i].z)}, i};
    }
    std::sort(keyed.begin(), keyed.end());
    order_.resize(n);
    std::transform(keyed.begin(), keyed.end(), order_.begin(), [](const auto& entry) { return entry.second; });
    for (std::size_t begin = 0, end = 0; begin < n; begin = end) {
      while (end < n && keyed[end].first == keyed[begin].first) ++end;
      cells_.push_back({keyed[begin].first, cluster(begin, end)});
    }
  }

  void unite_members(const Cell& cell) {
    for (std::size_t k = cell.members.begin + 1; k < cell.members.end; ++k) {
      sets_.unite(order_[cell.members.begin], order_[k]);
    }
  }

  // All cells against those of their row at (dx, dy). The cells are sorted, so the row's first neighbour only moves on.
  void sweep_row(std::int64_t dx, std::int64_t dy) {
    const std::int64_t first_dz = dx == 0 && dy == 0 ? 1 : -kReach;
    std::size_t cursor = 0;
    for (const Cell& cell : cells_) {
      const CellIndex first{cell.index.x + dx, cell.index.y + dy, cell.index.z + first_dz};
      const CellIndex last{first.x, first.y, cell.index.z + kReach};
      while (cursor < cells_.size() && cells_[cursor].index < first) ++cursor;
      for (std::size_t k = cursor; k < cells_.size() && cells_[k].index <= last; ++k) join(cell, cells_[k]);
    }
  }

  void join(const Cell& a, const Cell& b) {
    ++cost_.cell_pairs;
    const std::size_t i = order_[a.members.begin];
    const std::size_t j = order_[b.members.begin];
    if (sets_.find(i) != sets_.find(j) && any_friends(a.members, b.members)) sets_.unite(i, j);
  }

  // Whether some particle of a is a friend of one of b. Boxes around the particles decide most cases; else the longer
  // box is halved, so that crowded cells are not compared particle by particle.
  bool any_friends(const Cluster& a, const Cluster& b) {
    ++cost_.distances;
    if (nearest_squared(a.box, b.box) >= link_squared_) return false;
    if (farthest_squared(a.box, b.box) < link_squared_) return true;
    if (a.size() * b.size() <= kFewPairs) return any_pair(a, b);
    const std::size_t axis_a = a.box.longest_axis();
    const std::size_t axis_b = b.box.longest_axis();
    if (a.box.extent(axis_a) < b.box.extent(axis_b)) {
      const auto [low, high] = halve(b, axis_b);
      return any_friends(a, low) || any_friends(a, high);
    }
    const auto [low, high] = halve(a, axis_a);
    return any_friends(low, b) || any_friends(high, b);
  }

  bool any_pair(const Cluster& a, const Cluster& b) {
    for (std::size_t k = a.begin; k < a.end; ++k) {
      for (std::size_t l = b.begin; l < b.end; ++l) {
        ++cost_.distances;
        const Vec3d d = position_[order_[k]] - position_[order_[l]];
        if (dot(d, d) < link_squared_) return true;
      }
    }
    return false;
  }

  Cluster cluster(std::size_t begin, std::size_t end) {
    cost_.distances += end - begin;
    Box box{point(position_[order_[begin]]), point(position_[order_[begin]])};
    for (std::size_t k = begin + 1; k < end; ++k) {
      const Point p = point(position_[order_[k]]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box.low[axis] = std::min(box.low[axis], p[axis]);
        box.high[axis] = std::max(box.high[axis], p[axis]);
      }
    }
    return {begin, end, box};
  }

  // At the median, so that the two halves are never empty.
  std::pair<Cluster, Cluster> halve(const Cluster& whole, std::size_t axis) {
    const std::size_t middle = whole.begin + whole.size() / 2;
    const auto at = [this](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
    std::nth_element(at(whole.begin), at(middle), at(whole.end), [&](std::size_t i, std::size_t j) {
      return point(position_[i])[axis] < point(position_[j])[axis];
    });
    return {cluster(whole.begin, middle), cluster(middle, whole.end)};
  }

  std::span<const Vec3d> position_;
  double link_squared_;
  FriendsCost& cost_;
  UnionFind sets_;
  std::vector<std::size_t> order_;
  std::vector<Cell> cells_;
};

}  // namespace

UnionFind link_friends(std::span<const Vec3d> position, double link, FriendsCost& cost) {
  return Linker(position, link, cost).run();
}

}  // namespace breccia::analysis

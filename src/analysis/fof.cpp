#include "analysis/fof.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "breccia/error.hpp"

namespace breccia::analysis {
namespace {

struct BoundingBox {
  Vec3d low, high;

  [[nodiscard]] bool contains(Vec3d p, double margin) const {
    return p.x >= low.x - margin && p.x <= high.x + margin && p.y >= low.y - margin && p.y <= high.y + margin &&
           p.z >= low.z - margin && p.z <= high.z + margin;
  }
};

// Of an empty rank: contains nothing.
BoundingBox bounding_box(std::span<const Vec3d> position) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  BoundingBox box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  for (const Vec3d p : position) {
    box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
    box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
  }
  return box;
}

// Particle and id as they travel to the ranks that may have friends of it.
struct Visitor {
  Vec3d position;
  std::uint64_t id;
};

// For each rank, which of our particles lie within reach of its bounding box.
std::vector<std::vector<std::size_t>> within_reach(std::span<const Vec3d> position, double link,
                                                   const mpi::Comm& comm) {
  const std::vector<BoundingBox> boxes = comm.allgather(bounding_box(position));
  std::vector<std::vector<std::size_t>> of_rank(boxes.size());
  for (std::size_t r = 0; r < boxes.size(); ++r) {
    if (static_cast<int>(r) == comm.rank()) continue;
    for (std::size_t i = 0; i < position.size(); ++i) {
      if (boxes[r].contains(position[i], link)) of_rank[r].push_back(i);
    }
  }
  return of_rank;
}

// What of_rank names, taken from `values` by `pick`, for Comm::alltoall.
template <class T, class Pick>
std::vector<std::vector<T>> packed(const std::vector<std::vector<std::size_t>>& of_rank, Pick pick) {
  std::vector<std::vector<T>> to(of_rank.size());
  for (std::size_t r = 0; r < of_rank.size(); ++r) {
    for (const std::size_t i : of_rank[r]) to[r].push_back(pick(i));
  }
  return to;
}

void check(std::span<const Vec3d> position, double link, const mpi::Comm& comm) {
  if (!(link > 0.0) || !std::isfinite(link)) {
    throw UsageError("friends of friends: linking length " + std::to_string(link) + " m must be positive and finite");
  }
  // Cell indices are 64-bit integers.
  const double limit = 1e15 * link;
  const bool bad = std::any_of(position.begin(), position.end(), [limit](Vec3d p) {
    return !(std::abs(p.x) < limit && std::abs(p.y) < limit && std::abs(p.z) < limit);
  });
  if (comm.any(bad)) {
    throw NumericsError("friends of friends: a position is not finite or farther than 1e15 linking lengths from 0");
  }
}

}  // namespace

std::vector<std::uint64_t> find_groups(std::span<const Vec3d> position, std::span<const std::uint64_t> id, double link,
                                       const mpi::Comm& comm, FriendsCost* cost) {
  check(position, link, comm);
  const auto sent = within_reach(position, link, comm);
  const auto visitors = comm.alltoall(packed<Visitor>(sent, [&](std::size_t i) {
    return Visitor{position[i], id[i]};
  }));

  std::vector<Vec3d> all(position.begin(), position.end());
  std::vector<std::uint64_t> label(id.begin(), id.end());
  for (const auto& from_rank : visitors) {
    for (const Visitor& visitor : from_rank) {
      all.push_back(visitor.position);
      label.push_back(visitor.id);
    }
  }
  FriendsCost done;
  UnionFind sets = link_friends(all, link, done);
  if (cost != nullptr) *cost = done;

  // label[root] is the smallest id known of the set. A group may run through many ranks, so news travel one rank a
  // round until nobody learns any more.
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::uint64_t& smallest = label[sets.find(i)];
    smallest = std::min(smallest, label[i]);
  }
  bool news = comm.size() > 1;
  while (comm.any(news)) {
    news = false;
    const auto heard = comm.alltoall(packed<std::uint64_t>(sent, [&](std::size_t i) { return label[sets.find(i)]; }));
    std::size_t visitor = position.size();
    for (const auto& from_rank : heard) {
      for (const std::uint64_t theirs : from_rank) {
        std::uint64_t& smallest = label[sets.find(visitor++)];
        news = news || theirs < smallest;
        smallest = std::min(smallest, theirs);
      }
    }
  }
  std::vector<std::uint64_t> result(position.size());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = label[sets.find(i)];
  return result;
}

}  // namespace breccia::analysis

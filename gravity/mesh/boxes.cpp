#include "gravity/mesh/boxes.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace breccia::gravity {

double mesh_nodes(const Box& box, double cell) {
  const MeshSize size = MeshGeometry(box, cell).size;
  return 1.0 * size.nodes[0] * size.nodes[1] * size.nodes[2];
}

namespace {

// Blocks of space are this many mean distances wide, 64 particles where it is full. What has swelled much beyond that
// would have its neighbours beyond the reach of the pairs.
constexpr double kBlockWidth = 4.0;
constexpr std::int64_t kDenseCount = 24;

constexpr double kLeastParticlesPerNode = 0.05;

// One mesh over two boxes may have this many times the nodes of two meshes: it saves the tree between them.
constexpr double kMergeCost = 2.0;

/// The particles in one block of space.
struct Block {
  std::int32_t x, y, z;
  std::int64_t count = 0;
  double mass = 0.0;
  Box bounds{};

  void add(std::int64_t n, double m, const Box& b) {
    if (count == 0) bounds = b;
    count += n;
    mass += m;
    bounds.low = {std::min(bounds.low.x, b.low.x), std::min(bounds.low.y, b.low.y), std::min(bounds.low.z, b.low.z)};
    bounds.high = {std::max(bounds.high.x, b.high.x), std::max(bounds.high.y, b.high.y),
                   std::max(bounds.high.z, b.high.z)};
  }
};

// 21 bits per axis; blocks two million apart share a key, which only makes them one block.
std::uint64_t key_of(std::int32_t x, std::int32_t y, std::int32_t z) {
  constexpr std::uint64_t kMask = (1U << 21) - 1;
  const auto part = [](std::int32_t i) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) & kMask; };
  return part(x) << 42 | part(y) << 21 | part(z);
}

std::int32_t block_coordinate(double x, double width) {
  return static_cast<std::int32_t>(std::clamp(std::floor(x / width), -2e9, 2e9));
}

/// Occupied blocks in the order in which their first particles came.
class Blocks {
 public:
  Block& at(std::int32_t x, std::int32_t y, std::int32_t z) {
    const std::uint64_t key = key_of(x, y, z);
    // Particles mostly come in the order of space.
    if (all_.empty() || key != last_key_) {
      last_key_ = key;
      const auto [place, is_new] = index_.try_emplace(key, all_.size());
      if (is_new) all_.push_back({x, y, z});
      last_ = place->second;
    }
    return all_[last_];
  }
  /// Index of a block, or -1.
  [[nodiscard]] std::int64_t find(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const auto place = index_.find(key_of(x, y, z));
    return place == index_.end() ? -1 : static_cast<std::int64_t>(place->second);
  }
  [[nodiscard]] const std::vector<Block>& all() const { return all_; }

 private:
  std::vector<Block> all_;
  std::unordered_map<std::uint64_t, std::size_t> index_;
  std::uint64_t last_key_ = 0;
  std::size_t last_ = 0;
};

Blocks count_blocks(ParticlesView particles, double width, const mpi::Comm& comm) {
  Blocks own;
  for (std::size_t i = 0; i < particles.position.size(); ++i) {
    const Vec3d p = particles.position[i];
    own.at(block_coordinate(p.x, width), block_coordinate(p.y, width), block_coordinate(p.z, width))
        .add(1, particles.mass[i], {p, p});
  }
  if (comm.size() == 1) return own;
  Blocks blocks;
  for (const Block& b : comm.allgather_arrays<Block>(own.all()))
    blocks.at(b.x, b.y, b.z).add(b.count, b.mass, b.bounds);
  return blocks;
}

/// A body: its dense blocks and the blocks around them.
struct Region {
  Box box{};
  double mass = 0.0;
  std::int64_t count = 0;
};

template <class F>
void for_each_neighbour(const Blocks& blocks, const Block& b, const F& f) {
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dz = -1; dz <= 1; ++dz) {
        const std::int64_t n = blocks.find(b.x + dx, b.y + dy, b.z + dz);
        if (n >= 0) f(static_cast<std::size_t>(n));
      }
    }
  }
}

// The dense blocks connected with `start`, and the bounds of all particles in and next to them.
Region flood(const Blocks& blocks, std::size_t start, std::vector<bool>& seen) {
  Block sum{};
  std::vector<std::size_t> front{start};
  seen[start] = true;
  while (!front.empty()) {
    const Block& b = blocks.all()[front.back()];
    front.pop_back();
    sum.add(b.count, b.mass, b.bounds);
    for_each_neighbour(blocks, b, [&](std::size_t n) {
      const Block& neighbour = blocks.all()[n];
      sum.add(0, 0.0, neighbour.bounds);
      if (seen[n] || neighbour.count < kDenseCount) return;
      seen[n] = true;
      front.push_back(n);
    });
  }
  return {sum.bounds, sum.mass, sum.count};
}

Region merged(const Region& a, const Region& b) {
  Block sum{};
  sum.add(a.count, a.mass, a.box);
  sum.add(b.count, b.mass, b.box);
  return {sum.bounds, sum.mass, sum.count};
}

bool overlap(const Box& a, const Box& b) {
  return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
         a.low.z <= b.high.z && b.low.z <= a.high.z;
}

// Merges the first pair for which that is due; false if there is none.
bool merge_one_pair(std::vector<Region>& regions, double cell) {
  for (std::size_t i = 0; i < regions.size(); ++i) {
    for (std::size_t j = i + 1; j < regions.size(); ++j) {
      const Region both = merged(regions[i], regions[j]);
      const double apart = mesh_nodes(regions[i].box, cell) + mesh_nodes(regions[j].box, cell);
      if (!overlap(regions[i].box, regions[j].box) && mesh_nodes(both.box, cell) > kMergeCost * apart) continue;
      regions[i] = both;
      regions.erase(regions.begin() + static_cast<std::ptrdiff_t>(j));
      return true;
    }
  }
  return false;
}

// Of the particles in the emptier blocks, so that these hold `fraction` of them all, the last one's block's count.
std::int64_t count_at(const std::vector<std::int64_t>& sorted, double fraction) {
  std::int64_t all = 0;
  for (const std::int64_t count : sorted) all += count;
  std::int64_t before = 0;
  for (const std::int64_t count : sorted) {
    before += count;
    if (static_cast<double>(before) >= fraction * static_cast<double>(all)) return count;
  }
  return 0;
}

// How many particles share the block of the median one, without debris: blocks far emptier than those of the most
// crowded tenth, as a body of a tenth of the mass may get a box whatever there is around it.
std::int64_t median_dense_count(std::vector<std::int64_t> counts) {
  std::sort(counts.begin(), counts.end());
  const std::int64_t least = count_at(counts, 1.0 - kLeastBoxMass) / 8;
  counts.erase(counts.begin(), std::lower_bound(counts.begin(), counts.end(), least));
  return count_at(counts, 0.5);
}

}  // namespace

std::vector<Box> choose_boxes(ParticlesView particles, double spacing, double cell, const mpi::Comm& comm) {
  const Blocks blocks = count_blocks(particles, kBlockWidth * spacing, comm);
  double total = 0.0;
  for (const Block& b : blocks.all()) total += b.mass;

  std::vector<Region> regions;
  std::vector<bool> seen(blocks.all().size(), false);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i] || blocks.all()[i].count < kDenseCount) continue;
    const Region region = flood(blocks, i, seen);
    if (region.count < kLeastBoxParticles || region.mass < kLeastBoxMass * total) continue;
    if (static_cast<double>(region.count) < kLeastParticlesPerNode * mesh_nodes(region.box, cell)) continue;
    regions.push_back(region);
  }
  // Ties are broken by place, so that the order does not depend on that of the particles.
  std::sort(regions.begin(), regions.end(), [](const Region& a, const Region& b) {
    return a.count != b.count ? a.count > b.count : a.box.low.x < b.box.low.x;
  });
  while (merge_one_pair(regions, cell)) continue;
  if (regions.size() > kMostBoxes) regions.resize(kMostBoxes);

  std::vector<Box> boxes;
  for (const Region& r : regions) boxes.push_back(r.box);
  return boxes;
}

double dense_spacing(ParticlesView particles, const mpi::Comm& comm) {
  // Between 16 and 128 particles in the median dense particle's block; the width is narrowed towards that.
  constexpr std::int64_t kFewest = 16;
  constexpr std::int64_t kMost = 128;
  Block own{};
  for (const Vec3d p : particles.position) own.add(1, 0.0, {p, p});
  Block all{};
  for (const Block& b : comm.allgather(own)) {
    if (b.count > 0) all.add(b.count, 0.0, b.bounds);
  }
  const Vec3d extent = all.bounds.high - all.bounds.low;
  double width = std::max({extent.x, extent.y, extent.z});
  if (all.count < 2 || !(width > 0.0)) return 1.0;
  for (int halvings = 0;; ++halvings) {
    std::vector<std::int64_t> counts;
    const Blocks blocks = count_blocks(particles, width, comm);
    for (const Block& b : blocks.all()) counts.push_back(b.count);
    const std::int64_t count = median_dense_count(counts);
    const double spacing = width / std::cbrt(static_cast<double>(count));
    if (count <= kMost || halvings == 40) return spacing;
    // Never below the fewest: a third of the width has at least a 27th of the particles where they are even.
    width *= std::max(0.5, std::cbrt(static_cast<double>(kFewest) / static_cast<double>(count)));
  }
}

}  // namespace breccia::gravity

#include "gravity/mesh/boxes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gravity/mesh/block_sieve.hpp"

namespace breccia::gravity {

double mesh_nodes(const Box& box, double cell) {
  const MeshSize size = MeshGeometry(box, cell).size;
  return 1.0 * size.nodes[0] * size.nodes[1] * size.nodes[2];
}

namespace {

// Blocks of space are this many mean distances wide, 64 particles where it is full. What has swelled much beyond that
// would have its neighbours beyond the reach of the pairs.
constexpr double kBlockWidth = 4.0;
constexpr std::int64_t kFullCount = 64;
constexpr double kDense = 0.375;

// Where more blocks than this could be dense, they are twice as wide: all ranks must know them.
constexpr std::uint64_t kMostDenseBlocks = 4096;

// A rank names those blocks to the others in which it has its share of a dense one's particles, or this many.
constexpr std::int64_t kLeastNamed = 4;

constexpr double kLeastParticlesPerNode = 0.05;

// One mesh over two boxes may have this many times the nodes of two meshes: it saves the tree between them.
constexpr double kMergeCost = 2.0;

/// A body: its dense blocks and the blocks around them.
struct Region {
  Box box{};
  double mass = 0.0;
  std::int64_t count = 0;
};

template <class F>
void for_each_around(BlockIndex b, const F& f) {
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dz = -1; dz <= 1; ++dz) f(BlockIndex{b.x + dx, b.y + dy, b.z + dz});
    }
  }
}

template <class F>
void for_each_neighbour(const Blocks& blocks, BlockIndex b, const F& f) {
  for_each_around(b, [&](BlockIndex index) {
    const std::int64_t n = blocks.find(index);
    if (n >= 0) f(static_cast<std::size_t>(n));
  });
}

std::vector<BlockIndex> with_neighbours(const Blocks& blocks) {
  std::vector<BlockIndex> all;
  for (const Block& b : blocks.all()) for_each_around(b.index, [&](BlockIndex index) { all.push_back(index); });
  return all;
}

// Blocks that hold `least` particles of all ranks, the same on all of them but for the order. Counts them, those of
// this rank, into `own`.
Blocks dense_blocks(const BlockSieve& sieve, Blocks& own, std::int64_t least, const mpi::Comm& comm) {
  const std::int64_t share = comm.size() == 1 ? least : std::max(kLeastNamed, (least + comm.size() - 1) / comm.size());
  sieve.count_crowded(share, own);
  std::vector<BlockIndex> named;
  for (const Block& b : own.all()) {
    if (b.count >= share) named.push_back(b.index);
  }
  const std::vector<BlockIndex> named_by_all = comm.allgather_arrays(std::span<const BlockIndex>(named));
  sieve.count(named_by_all, own);
  Blocks all;
  for (const BlockIndex& index : named_by_all) all.at(index);
  std::vector<std::int64_t> counts;
  for (const Block& b : all.all()) {
    const std::int64_t here = own.find(b.index);
    counts.push_back(here >= 0 ? own.all()[static_cast<std::size_t>(here)].count : 0);
  }
  comm.sum(std::span<std::int64_t>(counts));
  Blocks dense;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] >= least) dense.at(all.all()[i].index).count = counts[i];
  }
  return dense;
}

// Numbers the connected parts of the dense blocks; returns how many there are.
std::size_t number_parts(const Blocks& dense, std::vector<std::size_t>& part) {
  constexpr std::size_t kNone = ~std::size_t{0};
  part.assign(dense.all().size(), kNone);
  std::size_t parts = 0;
  for (std::size_t start = 0; start < part.size(); ++start) {
    if (part[start] != kNone) continue;
    std::vector<std::size_t> front{start};
    part[start] = parts;
    while (!front.empty()) {
      const BlockIndex here = dense.all()[front.back()].index;
      front.pop_back();
      for_each_neighbour(dense, here, [&](std::size_t n) {
        if (part[n] != kNone) return;
        part[n] = parts;
        front.push_back(n);
      });
    }
    ++parts;
  }
  return parts;
}

// The connected parts of the dense blocks, with the bounds of all particles in and next to them.
std::vector<Region> dense_regions(const Blocks& own, const Blocks& dense, const mpi::Comm& comm) {
  constexpr double kFar = std::numeric_limits<double>::max();
  std::vector<std::size_t> part;
  const std::size_t parts = number_parts(dense, part);
  std::vector<double> sums(2 * parts, 0.0);
  std::vector<double> extremes(6 * parts, -kFar);  // highest coordinates and the negative of the lowest
  for (std::size_t i = 0; i < part.size(); ++i) {
    const BlockIndex index = dense.all()[i].index;
    const std::int64_t here = own.find(index);
    if (here >= 0) {
      sums[2 * part[i]] += static_cast<double>(own.all()[static_cast<std::size_t>(here)].count);
      sums[2 * part[i] + 1] += own.all()[static_cast<std::size_t>(here)].mass;
    }
    for_each_neighbour(own, index, [&](std::size_t n) {
      const Box& b = own.all()[n].bounds;
      const double values[6] = {b.high.x, b.high.y, b.high.z, -b.low.x, -b.low.y, -b.low.z};
      for (std::size_t k = 0; k < 6; ++k) extremes[6 * part[i] + k] = std::max(extremes[6 * part[i] + k], values[k]);
    });
  }
  comm.sum(std::span<double>(sums));
  comm.max(std::span<double>(extremes));
  std::vector<Region> regions;
  for (std::size_t p = 0; p < parts; ++p) {
    const double* e = &extremes[6 * p];
    regions.push_back(
        {{{-e[3], -e[4], -e[5]}, {e[0], e[1], e[2]}}, sums[2 * p + 1], static_cast<std::int64_t>(sums[2 * p])});
  }
  return regions;
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
std::int64_t count_at(std::span<const Occupancy> sorted, double fraction) {
  std::int64_t all = 0;
  for (const Occupancy& o : sorted) all += o.particles * o.blocks;
  std::int64_t before = 0;
  for (const Occupancy& o : sorted) {
    before += o.particles * o.blocks;
    if (static_cast<double>(before) >= fraction * static_cast<double>(all)) return o.particles;
  }
  return 0;
}

// How many particles share the block of the median one, without debris: blocks far emptier than those of the most
// crowded tenth, as a body of a tenth of the mass may get a box whatever there is around it.
std::int64_t median_dense_count(std::vector<Occupancy> blocks) {
  const std::int64_t least = count_at(blocks, 1.0 - kLeastBoxMass) / 8;
  std::erase_if(blocks, [&](const Occupancy& o) { return o.particles < least; });
  return count_at(blocks, 0.5);
}

}  // namespace

std::vector<Box> choose_boxes(ParticlesView particles, double spacing, double cell, const mpi::Comm& comm,
                              int threads) {
  std::int64_t full = kFullCount;
  double width = kBlockWidth * spacing;
  const std::uint64_t all = comm.sum(static_cast<std::uint64_t>(particles.position.size()));
  while (all > kMostDenseBlocks * static_cast<std::uint64_t>(full)) {
    full *= 8;
    width *= 2.0;
  }
  const BlockSieve sieve(particles, width, threads);
  const double total = comm.sum(sieve.mass());
  const auto least = static_cast<std::int64_t>(kDense * static_cast<double>(full));
  Blocks own;
  const Blocks dense = dense_blocks(sieve, own, least, comm);
  sieve.count(with_neighbours(dense), own);
  std::vector<Region> regions = dense_regions(own, dense, comm);
  std::erase_if(regions, [&](const Region& r) {
    return r.count < kLeastBoxParticles || r.mass < kLeastBoxMass * total ||
           static_cast<double>(r.count) < kLeastParticlesPerNode * mesh_nodes(r.box, cell);
  });
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
  // Between 16 and 128 particles in the median dense particle's block. The width is changed towards 45; blocks that are
  // filled in part hold more after that than expected.
  constexpr std::int64_t kFewest = 16;
  constexpr std::int64_t kMost = 128;
  constexpr double kWanted = 45.0;
  Block own{};
  for (const Vec3d p : particles.position) own.add(1, 0.0, {p, p});
  Block all{};
  for (const Block& b : comm.allgather(own)) {
    if (b.count > 0) all.add(b.count, 0.0, b.bounds);
  }
  const Vec3d extent = all.bounds.high - all.bounds.low;
  double width = std::max({extent.x, extent.y, extent.z});
  if (all.count < 2 || !(width > 0.0)) return 1.0;
  for (int trial = 0;; ++trial) {
    const std::int64_t count = median_dense_count(occupancy(particles, width, comm));
    const double spacing = width / std::cbrt(static_cast<double>(count));
    if ((count >= kFewest && count <= kMost) || (count <= kMost && trial == 0) || trial == 40) return spacing;
    width *= std::cbrt(kWanted / static_cast<double>(count));
  }
}

}  // namespace breccia::gravity

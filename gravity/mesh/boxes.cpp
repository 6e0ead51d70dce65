#include "gravity/mesh/boxes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "gravity/mesh/block_pairs.hpp"
#include "gravity/mesh/geometry.hpp"

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

// Blocks that hold `least` particles of all ranks, sorted.
std::vector<BlockIndex> dense_blocks(Census& census, std::int64_t least, const mpi::Comm& comm) {
  const std::int64_t share = comm.size() == 1 ? least : std::max(kLeastNamed, (least + comm.size() - 1) / comm.size());
  std::vector<BlockIndex> named;
  for (const BlockCount& b : census.crowded(share)) named.push_back(b.index);
  std::vector<BlockIndex> dense = comm.allgather_arrays(std::span<const BlockIndex>(named));
  std::sort(dense.begin(), dense.end());
  if (comm.size() == 1) return dense;
  dense.erase(std::unique(dense.begin(), dense.end()), dense.end());
  std::vector<std::int64_t> counts = census.counts(dense);
  comm.sum(std::span<std::int64_t>(counts));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] >= least) dense[kept++] = dense[i];
  }
  dense.resize(kept);
  return dense;
}

// Numbers the connected parts of the dense blocks in their order; returns how many there are.
std::size_t number_parts(std::span<const BlockIndex> dense, std::vector<std::size_t>& part) {
  // Each block is in the part of an earlier one that it touches, or begins one: a forest, kept flat.
  std::vector<std::size_t> earlier(dense.size());
  std::iota(earlier.begin(), earlier.end(), std::size_t{0});
  const auto first_of = [&](std::size_t i) {
    while (earlier[i] != i) i = earlier[i] = earlier[earlier[i]];
    return i;
  };
  for_each_touching(dense, dense, [&](std::size_t i, std::size_t j) {
    if (j >= i || earlier[i] == earlier[j]) return;
    const std::size_t a = first_of(i);
    const std::size_t b = first_of(j);
    earlier[std::max(a, b)] = std::min(a, b);
  });
  std::size_t parts = 0;
  part.resize(dense.size());
  for (std::size_t i = 0; i < dense.size(); ++i) part[i] = earlier[i] == i ? parts++ : part[earlier[i]];
  return parts;
}

// The connected parts of the dense blocks, with the bounds of all particles in and next to them.
std::vector<Region> dense_regions(std::span<const Block> blocks, std::span<const BlockIndex> dense,
                                  const mpi::Comm& comm) {
  constexpr double kFar = std::numeric_limits<double>::max();
  std::vector<std::size_t> part;
  const std::size_t parts = number_parts(dense, part);
  std::vector<double> sums(2 * parts, 0.0);
  std::vector<double> extremes(6 * parts, -kFar);  // highest coordinates and the negative of the lowest
  std::vector<const Block*> own;
  for (const Block& b : blocks) own.push_back(&b);
  std::sort(own.begin(), own.end(), [](const Block* a, const Block* b) { return a->index < b->index; });
  std::vector<BlockIndex> own_index;
  for (const Block* b : own) own_index.push_back(b->index);
  std::vector<std::size_t> bounded(own.size(), parts);  // the part whose bounds each has widened last
  for_each_touching(own_index, dense, [&](std::size_t i, std::size_t j) {
    const Block& b = *own[i];
    const std::size_t p = part[j];
    if (own_index[i] == dense[j]) {
      sums[2 * p] += static_cast<double>(b.count);
      sums[2 * p + 1] += b.mass;
    }
    if (bounded[i] == p) return;
    bounded[i] = p;
    const Vec3d high = b.bounds.high;
    const Vec3d low = b.bounds.low;
    const double values[6] = {high.x, high.y, high.z, -low.x, -low.y, -low.z};
    for (std::size_t k = 0; k < 6; ++k) extremes[6 * p + k] = std::max(extremes[6 * p + k], values[k]);
  });
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

// How many blocks hold how many particles, those of all ranks counted together.
struct Occupancy {
  std::int64_t particles;  // in each of these blocks
  std::int64_t blocks;
};

// Emptiest blocks first. Each rank sees a share of the blocks of all: those that their hash deals out to it.
std::vector<Occupancy> occupancy(Census& census, double width, const mpi::Comm& comm) {
  const auto ranks = static_cast<std::size_t>(comm.size());
  std::vector<std::vector<BlockCount>> to(ranks);
  for (const BlockCount& b : census.occupied(width)) to[hash_of(b.index) % ranks].push_back(b);
  Blocks mine;
  for (const std::vector<BlockCount>& from : comm.alltoall(to)) {
    for (const BlockCount& b : from) mine.at(b.index).count += b.particles;
  }
  std::map<std::int64_t, std::int64_t> number;
  for (const Block& b : mine.all()) ++number[b.count];
  std::vector<Occupancy> here;
  for (const auto& [count, blocks] : number) here.push_back({count, blocks});
  number.clear();
  for (const Occupancy& o : comm.allgather_arrays(std::span<const Occupancy>(here))) number[o.particles] += o.blocks;
  std::vector<Occupancy> all;
  for (const auto& [count, blocks] : number) all.push_back({count, blocks});
  return all;
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

std::vector<Box> choose_boxes(Census& census, double spacing, double cell, const mpi::Comm& comm) {
  std::int64_t full = kFullCount;
  double width = kBlockWidth * spacing;
  const std::uint64_t all = comm.sum(census.particles());
  while (all > kMostDenseBlocks * static_cast<std::uint64_t>(full)) {
    full *= 8;
    width *= 2.0;
  }
  census.divide(width);
  const double total = comm.sum(census.mass());
  const auto least = static_cast<std::int64_t>(kDense * static_cast<double>(full));
  const std::vector<BlockIndex> dense = dense_blocks(census, least, comm);
  std::vector<Region> regions = dense_regions(census.around(dense), dense, comm);
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

double dense_spacing(Census& census, const mpi::Comm& comm) {
  // Between 16 and 128 particles in the median dense particle's block. The width is changed towards 45; blocks that are
  // filled in part hold more after that than expected.
  constexpr std::int64_t kFewest = 16;
  constexpr std::int64_t kMost = 128;
  constexpr double kWanted = 45.0;
  Block own{};
  own.count = static_cast<std::int64_t>(census.particles());
  if (own.count > 0) own.bounds = census.bounds();
  Block all{};
  for (const Block& b : comm.allgather(own)) {
    if (b.count > 0) all.add(b.count, 0.0, b.bounds);
  }
  const Vec3d extent = all.bounds.high - all.bounds.low;
  double width = std::max({extent.x, extent.y, extent.z});
  if (all.count < 2 || !(width > 0.0)) return 1.0;
  for (int trial = 0;; ++trial) {
    const std::int64_t count = median_dense_count(occupancy(census, width, comm));
    const double spacing = width / std::cbrt(static_cast<double>(count));
    if ((count >= kFewest && count <= kMost) || (count <= kMost && trial == 0) || trial == 40) return spacing;
    width *= std::cbrt(kWanted / static_cast<double>(count));
  }
}

}  // namespace breccia::gravity

#include "cuda/gravity_memory.hpp"

#include <algorithm>
#include <cmath>

#include "cuda/device_census.hpp"
#include "cuda/direct_gravity.hpp"
#include "cuda/mesh_kernels.hpp"
#include "cuda/tree_kernels.hpp"
#include "gravity/mesh/box_mesh.hpp"
#include "gravity/mesh/convolution.hpp"

namespace breccia::cuda {
namespace {

using gravity::MeshSize;

// Of a radix sort: keys and order twice, and half a byte of counts.
constexpr std::uint64_t kSortBytes = 2 * (sizeof(std::uint64_t) + sizeof(unsigned)) + 1;
constexpr std::uint64_t kBodyBytes = 4 * sizeof(double);  // position and mass

// With the room that arrays keep (DeviceArray::reserve).
std::uint64_t with_room(double bytes) { return static_cast<std::uint64_t>(1.125 * bytes); }

std::uint64_t volume(int a, int b, int c) {
  return static_cast<std::uint64_t>(a) * static_cast<std::uint64_t>(b) * static_cast<std::uint64_t>(c);
}

// Measured in spheres and in debris of 2,400 to 12,000 particles: 0.125 to 0.157 cells a particle, of which a level has
// at most half; arrays of cells have half as much again of room, and while they grow the old ones are there too.
std::uint64_t tree_bytes(std::uint64_t bodies) {
  constexpr double cells = 0.16;
  constexpr double growth = 1.5 + 1.0;
  constexpr double cell = growth * (sizeof(gravity::Cell) + 2 * sizeof(std::int32_t) + sizeof(double));
  constexpr double split = 0.5 * (sizeof(unsigned) + (gravity::kMostChildren + 2) * sizeof(std::int32_t));
  return with_room(static_cast<double>(bodies) * (kSortBytes + kBodyBytes + sizeof(unsigned) + cells * (cell + split)));
}

// In the same states a step of the walk has up to 0.011 targets, 1.2 pairs and, at the usual error, 5 listed cells for
// each particle, with an opening of 1.1e-5 half as many again; twice that for larger trees.
std::uint64_t walk_bytes(std::uint64_t own, double opening) {
  constexpr double targets = 0.015;
  constexpr double pairs = 2.5;
  const double listed = 10.0 * std::max(1.0, std::pow(1.2e-4 / opening, 0.2));
  constexpr double front = 2 * (sizeof(WalkTarget) + sizeof(FarField)) + 4 * sizeof(unsigned);
  const double bytes = targets * front + pairs * (kLists + 1) * sizeof(unsigned) +
                       listed * 2 * sizeof(std::int32_t);  // leaves and candidates are listed again
  return with_room(static_cast<double>(own) * bytes);
}

// Of the rank that has most of it.
template <class Real>
std::uint64_t convolution_bytes(const MeshSize& size, int ranks) {
  constexpr std::uint64_t complex = 2 * sizeof(Real);
  const double doubled = 1.0 * size.padded[0] * size.padded[1] * size.padded[2];
  if (doubled <= gravity::MeshSharing{}.replicated_nodes) ranks = 1;
  const int half = size.padded[2] / 2 + 1;
  const int own_y = gravity::share_of_planes(size.padded[1], ranks, 0).count();
  const int own_x = gravity::share_of_planes(size.nodes[0], ranks, 0).count();
  const std::uint64_t kernel =
      sizeof(Real) * volume(std::min(own_y, size.padded[1] / 2 + 1), size.padded[0] / 2 + 1, half);
  const std::uint64_t by_x = complex * volume(ranks > 1 ? own_x : size.padded[0], size.padded[1], half);
  const std::uint64_t by_y = complex * volume(size.padded[0], own_y, half);
  // cuFFT works in an area of the size of what it transforms.
  const std::uint64_t work = std::max(complex * volume(own_x, size.padded[1], half), by_y);
  if (ranks == 1) return kernel + by_x + work;
  const std::uint64_t nodes =
      volume(own_x, size.nodes[1], size.nodes[2]) + volume(size.nodes[0], size.nodes[1], size.nodes[2]);
  return kernel + by_x + by_y + work + sizeof(Real) * nodes;
}

template <class Real>
std::uint64_t box_bytes(const BoxLoad& box, int ranks) {
  const int* nodes = box.size.nodes;
  // Columns are two nodes wide for the usual cell; some have no nodes beyond the edge.
  const std::uint64_t columns = volume(nodes[0] / 2 + 1, nodes[1] / 2 + 1, 1);
  const std::uint64_t keys = 4 * columns * static_cast<std::uint64_t>(nodes[2]);
  const std::uint64_t clusters = box.particles / kClusterBodies + columns;
  const std::uint64_t sorted = box.particles * (kSortBytes + kBodyBytes + sizeof(unsigned)) +
                               (keys + columns) * sizeof(unsigned) + clusters * sizeof(Cluster<Real>) +
                               volume(nodes[0], nodes[1], nodes[2]) * sizeof(NodeField<Real>);
  return with_room(static_cast<double>(sorted)) + convolution_bytes<Real>(box.size, ranks);
}

std::uint64_t direct_bytes(const GravityLoad& load) {
  const auto slices = direct_slices(static_cast<unsigned>(load.own), static_cast<unsigned>(load.all)).count;
  return with_room(3.0 * sizeof(double) * static_cast<double>(load.own) * slices);
}

// Dense blocks are few where particles are many (gravity/mesh/boxes.cpp); each is listed with up to 26 around it, of
// which seldom more than four hold particles that no other one has listed. Ranks list blocks with few of theirs.
std::uint64_t census_bytes(const GravityLoad& load) {
  constexpr double most_blocks = 12'000;
  constexpr double contents = 5.0;
  const double blocks = std::min(static_cast<double>(load.own) / (load.ranks > 1 ? 4.0 : 24.0), most_blocks);
  constexpr double block = sizeof(CountedBlock) + sizeof(gravity::BlockIndex) +
                           (1 + gravity::kBlocksAround) * sizeof(unsigned) + contents * sizeof(BlockSums);
  return with_room(static_cast<double>(3 * sizeof(unsigned) * table_slots(load.own)) + blocks * block);
}

// Positions and masses of all, accelerations of this rank's, what thread blocks find, counters, blocks of space.
std::uint64_t common_bytes(const GravityLoad& load) {
  const auto own = static_cast<double>(load.own);
  const auto all = load.ranks > 1 ? static_cast<double>(load.all) : 0.0;
  constexpr double found = kMostReducers * (sizeof(Extremes) + sizeof(NetForce)) + 4096.0;
  return with_room(own * (kBodyBytes + 3 * sizeof(double)) + all * kBodyBytes + found) +
         (load.seeks_boxes ? census_bytes(load) : 0);
}

}  // namespace

template <class Real>
std::uint64_t bytes_for_gravity(GravityMethod method, const GravityLoad& load) {
  if (load.all == 0) return 0;
  const std::uint64_t trees = tree_bytes(load.all) + walk_bytes(load.own, load.opening);
  if (method == GravityMethod::kDirect) return common_bytes(load) + direct_bytes(load);
  if (method == GravityMethod::kTree) return common_bytes(load) + trees;
  std::uint64_t bytes = common_bytes(load) + with_room(static_cast<double>(load.all * (kSortBytes + kBodyBytes)));
  std::uint64_t in_boxes = 0;
  for (const BoxLoad& box : load.boxes) {
    bytes += box_bytes<Real>(box, load.ranks);
    in_boxes += box.particles;
  }
  return load.boxes.size() == 1 && in_boxes == load.all ? bytes : bytes + trees;
}

template std::uint64_t bytes_for_gravity<float>(GravityMethod, const GravityLoad&);
template std::uint64_t bytes_for_gravity<double>(GravityMethod, const GravityLoad&);

}  // namespace breccia::cuda

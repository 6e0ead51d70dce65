#include "gravity/mesh/host_census.hpp"

namespace breccia::gravity {

Box HostCensus::bounds() {
  Block all{};
  for (const Vec3d p : particles_.position) all.add(1, 0.0, {p, p});
  return all.bounds;
}

std::vector<BlockCount> HostCensus::occupied(double width) {
  sieve_.reset();
  std::vector<BlockCount> found;
  const Blocks all = count_in_blocks(particles_, width);
  for (const Block& b : all.all()) found.push_back({.index = b.index, .particles = b.count});
  return found;
}

void HostCensus::divide(double width) {
  sieve_.emplace(particles_, width, threads_);
  counted_ = {};
}

std::vector<BlockCount> HostCensus::crowded(std::int64_t least) {
  sieve_->count_crowded(least, counted_);
  std::vector<BlockCount> found;
  for (const Block& b : counted_.all()) {
    if (b.count >= least) found.push_back({.index = b.index, .particles = b.count});
  }
  return found;
}

std::vector<std::int64_t> HostCensus::counts(std::span<const BlockIndex> blocks) {
  sieve_->count(blocks, counted_);
  std::vector<std::int64_t> found;
  for (const BlockIndex index : blocks) {
    const std::int64_t place = counted_.find(index);
    found.push_back(place >= 0 ? counted_.all()[static_cast<std::size_t>(place)].count : 0);
  }
  return found;
}

std::span<const Block> HostCensus::around(std::span<const BlockIndex> blocks) {
  std::vector<BlockIndex> wanted;
  for (const BlockIndex index : blocks) {
    for (int n = 0; n < kBlocksAround; ++n) wanted.push_back(block_around(index, n));
  }
  sieve_->count(wanted, counted_);
  return counted_.all();
}

std::vector<SetSum> HostCensus::sets(std::span<const Box> boxes) {
  set_.resize(particles_.position.size());
#pragma omp parallel for num_threads(threads_) schedule(static)
  for (std::size_t i = 0; i < set_.size(); ++i) set_[i] = set_of(particles_.position[i], boxes.data(), boxes.size());
  std::vector<SetSum> sums(boxes.size() + 1);
  for (std::size_t i = 0; i < set_.size(); ++i) {
    ++sums[set_[i]].particles;
    sums[set_[i]].mass += particles_.mass[i];
  }
  return sums;
}

}  // namespace breccia::gravity

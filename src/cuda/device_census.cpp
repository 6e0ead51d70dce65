#include "cuda/device_census.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace breccia::cuda {

using gravity::Block;
using gravity::BlockCount;
using gravity::BlockIndex;

void DeviceCensus::take(const BodyArrays& bodies, double heaviest) {
  bodies_ = bodies;
  // The sum of all masses stays below 2^62 quanta.
  int exponent = 0;
  std::frexp(heaviest, &exponent);
  quanta_per_kg_ = std::ldexp(1.0, 62 - exponent - static_cast<int>(std::bit_width(bodies.count)));
}

void DeviceCensus::forget() {
  for (DeviceArray<unsigned>* array : {&body_, &count_, &place_, &found_, &slots_, &counts_}) *array = {};
  crowded_ = {};
  asked_ = {};
  sums_ = {};
  set_sums_ = {};
  extremes_ = {};
  bodies_ = {};
}

BlockTable DeviceCensus::table() const {
  return {bodies_, per_width_, static_cast<unsigned>(body_.size()), body_.data(), count_.data(), place_.data()};
}

gravity::Box DeviceCensus::bounds() {
  const unsigned parts = reducers(bodies_.count);
  extremes_.reserve(parts);
  launch_extremes(bodies_, extremes_.data(), stream_);
  Block all{};
  for (const Extremes& part : extremes_.download(parts, stream_)) {
    const double(&e)[7] = part.of;
    if (e[0] >= -e[3]) all.add(1, 0.0, {{-e[3], -e[4], -e[5]}, {e[0], e[1], e[2]}});
  }
  return all.bounds;
}

std::vector<BlockCount> DeviceCensus::occupied(double width) {
  divide(width);
  return crowded(1);
}

void DeviceCensus::divide(double width) {
  per_width_ = 1.0 / width;
  const std::size_t slots = table_slots(bodies_.count);
  for (DeviceArray<unsigned>* array : {&body_, &count_, &place_}) array->reserve(slots);
  body_.fill_bytes(0xff, stream_);
  count_.fill_bytes(0, stream_);
  launch_count_in_blocks(table(), stream_);
}

template <class Launch>
unsigned DeviceCensus::count_found(const Launch& launch) {
  found_.reserve(1);
  found_.fill_bytes(0, stream_);
  launch(found_.data());
  return found_.download(1, stream_)[0];
}

std::vector<BlockCount> DeviceCensus::crowded(std::int64_t least) {
  const auto list = [&](CountedBlock* to) {
    return count_found(
        [&](unsigned* found) { launch_list_crowded(table(), static_cast<unsigned>(least), found, to, stream_); });
  };
  crowded_.reserve(list(nullptr));
  list(crowded_.data());
  std::vector<BlockCount> blocks;
  for (const CountedBlock& b : crowded_.download(crowded_.size(), stream_)) {
    blocks.push_back({.index = b.index, .particles = b.count});
  }
  return blocks;
}

void DeviceCensus::send(std::span<const BlockIndex> blocks) {
  asked_.reserve(blocks.size());
  asked_.upload(blocks, stream_);
}

std::vector<std::int64_t> DeviceCensus::counts(std::span<const BlockIndex> blocks) {
  send(blocks);
  counts_.reserve(blocks.size());
  launch_counts_of(table(), asked_.data(), static_cast<unsigned>(blocks.size()), counts_.data(), stream_);
  const std::vector<unsigned> found = counts_.download(blocks.size(), stream_);
  return {found.begin(), found.end()};
}

std::span<const Block> DeviceCensus::around(std::span<const BlockIndex> blocks) {
  send(blocks);
  slots_.reserve(std::min(gravity::kBlocksAround * blocks.size(), body_.size()));
  place_.fill_bytes(0xff, stream_);
  const unsigned listed = count_found([&](unsigned* found) {
    launch_list_around(table(), asked_.data(), static_cast<unsigned>(blocks.size()), slots_.data(), found, stream_);
  });
  sums_.reserve(listed);
  sums_.fill_bytes(0, stream_);
  launch_sum_blocks(table(), slots_.data(), listed, quanta_per_kg_, sums_.data(), stream_);
  around_.clear();
  for (const BlockSums& s : sums_.download(listed, stream_)) {
    const auto extreme = [&s](int k) { return of_rank(s.extreme[k]); };
    around_.push_back({.index = s.index,
                       .count = s.count,
                       .mass = in_kg(s.mass),
                       .bounds = {{-extreme(3), -extreme(4), -extreme(5)}, {extreme(0), extreme(1), extreme(2)}}});
  }
  return around_;
}

std::vector<gravity::SetSum> DeviceCensus::sets(std::span<const gravity::Box> boxes) {
  BoxList list;
  list.count = boxes.size();
  std::copy(boxes.begin(), boxes.end(), list.box);
  set_sums_.reserve(1);
  set_sums_.fill_bytes(0, stream_);
  launch_sum_sets(bodies_, list, quanta_per_kg_, set_sums_.data(), stream_);
  const SetSums found = set_sums_.download(1, stream_)[0];
  std::vector<gravity::SetSum> sums;
  for (std::size_t k = 0; k <= boxes.size(); ++k) sums.push_back({found.count[k], in_kg(found.mass[k])});
  return sums;
}

}  // namespace breccia::cuda

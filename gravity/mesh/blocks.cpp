#include "gravity/mesh/blocks.hpp"

#include <algorithm>
#include <iterator>

namespace breccia::gravity {

void Block::add(std::int64_t n, double m, const Box& b) {
  if (count == 0) bounds = b;
  count += n;
  mass += m;
  bounds.low = {std::min(bounds.low.x, b.low.x), std::min(bounds.low.y, b.low.y), std::min(bounds.low.z, b.low.z)};
  bounds.high = {std::max(bounds.high.x, b.high.x), std::max(bounds.high.y, b.high.y),
                 std::max(bounds.high.z, b.high.z)};
}

std::size_t Blocks::slot_of(BlockIndex index) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = hash_of(index) & mask;
  while (slots_[slot] >= 0 && !(all_[static_cast<std::size_t>(slots_[slot])].index == index)) slot = (slot + 1) & mask;
  return slot;
}

void Blocks::prefetch(BlockIndex index) const { __builtin_prefetch(&slots_[hash_of(index) & (slots_.size() - 1)]); }

std::int64_t Blocks::place_of(BlockIndex index) {
  const std::size_t slot = slot_of(index);
  if (slots_[slot] >= 0) return slots_[slot];
  slots_[slot] = static_cast<std::int32_t>(all_.size());
  all_.push_back({index});
  if (2 * all_.size() > slots_.size()) grow();
  return std::ssize(all_) - 1;
}

void Blocks::grow() {
  slots_.assign(4 * slots_.size(), -1);
  for (std::size_t i = 0; i < all_.size(); ++i) slots_[slot_of(all_[i].index)] = static_cast<std::int32_t>(i);
}

Blocks count_in_blocks(ParticlesView particles, double width) {
  // Each particle of debris asks for another block, and waits for memory unless that has been told so long before.
  constexpr std::size_t kAhead = 16;
  Blocks blocks;
  BlockIndex last{};
  Block* here = nullptr;
  const double per_width = 1.0 / width;
  const std::size_t n = particles.position.size();
  BlockIndex soon[kAhead] = {};
  const auto look_ahead = [&](std::size_t i) {
    if (i >= n) return;
    soon[i % kAhead] = block_of(particles.position[i], per_width);
    blocks.prefetch(soon[i % kAhead]);
  };
  for (std::size_t i = 0; i < kAhead; ++i) look_ahead(i);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3d p = particles.position[i];
    const BlockIndex index = soon[i % kAhead];
    look_ahead(i + kAhead);
    // Particles mostly come in the order of space.
    if (here == nullptr || !(index == last)) here = &blocks.at(last = index);
    here->add(1, particles.mass[i], {p, p});
  }
  return blocks;
}

}  // namespace breccia::gravity

// Finds the crowded blocks of space among many that hold a particle or two.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gravity/mesh/blocks.hpp"

namespace breccia::gravity {

/// Debris fills a block with each particle, and to look each of them up in a hash map would be to wait for memory. Here
/// blocks first share a few counters, which stay in the cache: a counter is never less than what one of its blocks
/// holds, so only blocks with a high one need be counted. Particles are kept by reference.
class BlockSieve {
 public:
  /// Cubes of `width` [m].
  BlockSieve(ParticlesView particles, double width, int threads);

  /// Of this rank's particles [kg]; does not depend on the threads.
  [[nodiscard]] double mass() const { return mass_; }

  /// Adds all blocks of at least `least` particles to `blocks`, and some with fewer, unless they are there already.
  void count_crowded(std::int64_t least, Blocks& blocks) const;
  /// Adds the blocks `wanted`, as far as they hold particles, and some others, unless they are there already.
  void count(std::span<const BlockIndex> wanted, Blocks& blocks) const;

 private:
  static constexpr std::size_t kSlots = std::size_t{1} << 16;

  void count_slots(const std::vector<char>& wanted, Blocks& blocks) const;

  ParticlesView particles_;
  double per_width_;
  int threads_;
  double mass_ = 0.0;
  std::vector<std::uint16_t> slot_;   // of each particle
  std::vector<std::int64_t> counts_;  // of each slot
};

}  // namespace breccia::gravity

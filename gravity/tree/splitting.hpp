// How a cell of the tree splits into its parts, from sorted keys alone: on host and device.
#pragma once

#include <cstddef>
#include <cstdint>

#include "breccia/macros.hpp"
#include "gravity/tree/cell.hpp"
#include "gravity/tree/morton.hpp"

namespace breccia::gravity {

/// Cells of more particles than max(group, all/kCoarseCells) make up the coarse tree, of which scales are sampled.
inline constexpr std::int64_t kCoarseCells = 1024;
BRECCIA_HD std::int64_t coarse_limit(std::int64_t all_particles) {
  const std::int64_t share = all_particles / kCoarseCells;
  return share > kGroupParticles ? share : kGroupParticles;
}

inline constexpr std::size_t kMostChildren = 8;

/// Its children differ in `bits` key bits after the first `start`; bits = 0 for a leaf.
struct Split {
  int start = 0;
  int bits = 0;
};

/// Leading key bits that two keys share.
BRECCIA_HD int shared_bits(std::uint64_t low, std::uint64_t high) {
  int bits = kKeyBits;
  for (std::uint64_t differ = low ^ high; differ != 0; differ >>= 1) --bits;
  return bits;
}

/// `low` and `high`: smallest and largest key of the cell, of all ranks.
BRECCIA_HD Split split_of(std::int64_t count, int key_bits, std::uint64_t low, std::uint64_t high) {
  const std::int64_t limit = count > kGroupParticles ? kGroupParticles : kLeafParticles;
  if (count <= kLeafParticles || low == high) return {};
  const int common = shared_bits(low, high);
  const int shared = key_bits > common ? key_bits : common;
  // Enough bits to come down to the limit if the particles are spread evenly. Cubes split into cubes.
  const int needed = count > 4 * limit ? 3 : (count > 2 * limit ? 2 : 1);
  const int cube = shared - shared % 3;
  const int start = needed < 3 ? shared : (key_bits > cube ? key_bits : cube);
  return {start, needed < kKeyBits - start ? needed : kKeyBits - start};
}

/// The first `bits` bits of a key: what the particles of a cell share.
BRECCIA_HD std::uint64_t prefix(std::uint64_t key, int bits) { return bits == 0 ? 0 : key >> (kKeyBits - bits); }

}  // namespace breccia::gravity

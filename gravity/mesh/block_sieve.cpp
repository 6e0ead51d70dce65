#include "gravity/mesh/block_sieve.hpp"

#include <omp.h>

#include <algorithm>
#include <array>

namespace breccia::gravity {
namespace {

// Particles are counted in pieces that do not depend on the threads, and sums with them.
constexpr std::size_t kPiece = std::size_t{1} << 15;

// A block that particles were counted in, and where it is; -1: counted before.
struct Recent {
  BlockIndex index{};
  bool used = false;
  std::int64_t place = -1;
};
constexpr std::size_t kRecent = 64;

std::size_t slot_of(BlockIndex index, std::size_t slots) { return hash_of(index) & (slots - 1); }

}  // namespace

BlockSieve::BlockSieve(ParticlesView particles, double width, int threads)
    : particles_(particles), per_width_(1.0 / width), threads_(threads), counts_(kSlots, 0) {
  const std::size_t n = particles.position.size();
  const std::size_t pieces = (n + kPiece - 1) / kPiece;
  slot_.resize(n);
  std::vector<double> mass(pieces, 0.0);
  std::vector<std::vector<std::int64_t>> counts(static_cast<std::size_t>(threads));
#pragma omp parallel num_threads(threads)
  {
    std::vector<std::int64_t>& mine = counts[static_cast<std::size_t>(omp_get_thread_num())];
    mine.assign(kSlots, 0);
#pragma omp for schedule(static)
    for (std::size_t piece = 0; piece < pieces; ++piece) {
      double sum = 0.0;
      for (std::size_t i = piece * kPiece; i < std::min(n, (piece + 1) * kPiece); ++i) {
        const std::size_t slot = slot_of(block_of(particles.position[i], per_width_), kSlots);
        slot_[i] = static_cast<std::uint16_t>(slot);
        ++mine[slot];
        sum += particles.mass[i];
      }
      mass[piece] = sum;
    }
  }
  for (const double m : mass) mass_ += m;
  for (const std::vector<std::int64_t>& mine : counts) {
    for (std::size_t slot = 0; slot < mine.size(); ++slot) counts_[slot] += mine[slot];
  }
}

void BlockSieve::count_crowded(std::int64_t least, Blocks& blocks) const {
  std::vector<char> wanted(kSlots, 0);
  for (std::size_t slot = 0; slot < kSlots; ++slot) wanted[slot] = counts_[slot] >= least ? 1 : 0;
  count_slots(wanted, blocks);
}

void BlockSieve::count(std::span<const BlockIndex> wanted, Blocks& blocks) const {
  std::vector<char> slots(kSlots, 0);
  bool any = false;
  for (const BlockIndex index : wanted) {
    if (blocks.find(index) >= 0) continue;
    slots[slot_of(index, kSlots)] = 1;
    any = true;
  }
  if (any) count_slots(slots, blocks);
}

void BlockSieve::count_slots(const std::vector<char>& wanted, Blocks& blocks) const {
  const std::size_t n = slot_.size();
  std::vector<Blocks> parts((n + kPiece - 1) / kPiece);
#pragma omp parallel for num_threads(threads_) schedule(dynamic, 1)
  for (std::size_t piece = 0; piece < parts.size(); ++piece) {
    // Particles mostly come in the order of space, those of a few blocks mixed.
    std::array<Recent, kRecent> recent{};
    for (std::size_t i = piece * kPiece; i < std::min(n, (piece + 1) * kPiece); ++i) {
      if (wanted[slot_[i]] == 0) continue;
      const Vec3d p = particles_.position[i];
      const BlockIndex index = block_of(p, per_width_);
      Recent& r = recent[slot_[i] % kRecent];
      if (!r.used || !(r.index == index)) {
        r = {index, true, blocks.find(index) < 0 ? parts[piece].place_of(index) : -1};
      }
      if (r.place >= 0) parts[piece].all()[static_cast<std::size_t>(r.place)].add(1, particles_.mass[i], {p, p});
    }
  }
  for (const Blocks& part : parts) {
    for (const Block& b : part.all()) blocks.at(b.index).add(b.count, b.mass, b.bounds);
  }
}

}  // namespace breccia::gravity

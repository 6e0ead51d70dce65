#include "gravity/tree/radix_sort.hpp"

#include <algorithm>
#include <array>

namespace breccia::gravity {
namespace {

constexpr int kDigitBits = 11;
constexpr std::size_t kBuckets = std::size_t{1} << kDigitBits;
constexpr std::size_t kItemsWorthAThread = 20'000;

std::size_t digit(std::uint64_t key, int shift) { return static_cast<std::size_t>(key >> shift) & (kBuckets - 1); }

using Histogram = std::array<std::size_t, kBuckets>;

// Where each chunk's items of each digit begin; false if all items have the same digit and may stay.
bool counts_to_offsets(std::vector<Histogram>& chunks, std::size_t total) {
  std::size_t offset = 0;
  for (std::size_t b = 0; b < kBuckets; ++b) {
    const std::size_t before = offset;
    for (Histogram& chunk : chunks) {
      const std::size_t count = chunk[b];
      chunk[b] = offset;
      offset += count;
    }
    if (offset - before == total) return false;
  }
  return true;
}

}  // namespace

void radix_sort(std::vector<KeyedIndex>& items, std::vector<KeyedIndex>& scratch, int threads) {
  const std::size_t n = items.size();
  scratch.resize(n);
  const std::size_t chunks = std::clamp<std::size_t>(n / kItemsWorthAThread, 1, static_cast<std::size_t>(threads));
  std::vector<Histogram> offsets(chunks);
  for (int shift = 0; shift < 64; shift += kDigitBits) {
#pragma omp parallel for num_threads(static_cast <int>(chunks)) schedule(static)
    for (std::size_t c = 0; c < chunks; ++c) {
      offsets[c].fill(0);
      for (std::size_t i = n * c / chunks; i < n * (c + 1) / chunks; ++i) ++offsets[c][digit(items[i].key, shift)];
    }
    if (!counts_to_offsets(offsets, n)) continue;
#pragma omp parallel for num_threads(static_cast <int>(chunks)) schedule(static)
    for (std::size_t c = 0; c < chunks; ++c) {
      for (std::size_t i = n * c / chunks; i < n * (c + 1) / chunks; ++i) {
        scratch[offsets[c][digit(items[i].key, shift)]++] = items[i];
      }
    }
    items.swap(scratch);
  }
}

}  // namespace breccia::gravity

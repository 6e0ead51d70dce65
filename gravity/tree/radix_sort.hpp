// Stable sort of keys with the index of the particle they came from.
#pragma once

#include <cstdint>
#include <vector>

namespace breccia::gravity {

struct KeyedIndex {
  std::uint64_t key;
  std::int64_t index;
};

/// Sorts by key, least significant digit first; equal keys keep their order, whatever the number of threads.
/// `scratch` is working memory.
void radix_sort(std::vector<KeyedIndex>& items, std::vector<KeyedIndex>& scratch, int threads);

}  // namespace breccia::gravity

#include "cuda/body_sets.hpp"

#include <algorithm>

#include "cuda/mesh_kernels.hpp"

namespace breccia::cuda {

void BodySets::divide(const BodyArrays& all, std::span<const gravity::Box> boxes) {
  constexpr int kSetBits = 8;
  const std::size_t n = all.count;
  const auto sets = static_cast<unsigned>(boxes.size() + 1);
  keys_.reserve(n);
  order_.reserve(n);
  first_.reserve(sets + 1);
  bodies_.reserve(4 * n);
  BoxList list;
  list.count = boxes.size();
  std::copy(boxes.begin(), boxes.end(), list.box);
  launch_set_keys(all, list, keys_.data(), order_.data(), stream_);
  radix_sort(keys_, order_, all.count, 0, kSetBits, scratch_, stream_);
  first_of_keys(keys_.data(), all.count, sets, first_.data(), stream_);
  launch_gather_bodies(all, order_.data(), bodies_.data(), stream_);
  const std::vector<unsigned> first = first_.download(sets + 1, stream_);
  sets_.clear();
  for (unsigned k = 0; k < sets; ++k) {
    const double* x = bodies_.data() + first[k];
    sets_.push_back({{x, x + n, x + 2 * n}, x + 3 * n, first[k + 1] - first[k], order_.data() + first[k]});
  }
}

}  // namespace breccia::cuda

#include "cuda/device_tree.hpp"

#include <utility>

namespace breccia::cuda {
namespace {

// A longer array with the same values at its beginning.
template <class T>
void lengthen(DeviceArray<T>& array, std::size_t used, std::size_t size, cudaStream_t stream) {
  if (size <= array.capacity()) return array.reserve(size);
  DeviceArray<T> longer;
  longer.reserve(size, size / 2);
  if (used > 0) {
    check(cudaMemcpyAsync(longer.data(), array.data(), used * sizeof(T), cudaMemcpyDeviceToDevice, stream), "copy");
    check(cudaStreamSynchronize(stream), "copy");
  }
  array = std::move(longer);
}

}  // namespace

void DeviceTree::build(const BodyArrays& bodies, const gravity::Root& root, double mass_unit, unsigned first,
                       unsigned own) {
  count_ = bodies.count;
  if (count_ == 0) return;
  sort(bodies, root, mass_unit, first, own);
  grow();
  for (auto level = levels_.rbegin(); level != levels_.rend(); ++level) {
    launch_moments(view(), this->bodies(), *level, stream_);
  }
}

void DeviceTree::weigh(const OtherRoots& others, double softening) {
  if (count_ == 0) return;
  heavy_.reserve(1);
  heavy_.fill_bytes(0, stream_);
  const std::int64_t coarse = gravity::coarse_limit(count_);
  launch_list_heavy(view(), coarse, heavy_.data(), stream_);
  launch_sample_scales(view(), bodies(), heavy_.data(), others, coarse, softening, stream_);
  if (comm_.size() > 1) share_scales();
  for (auto level = levels_.rbegin(); level != levels_.rend(); ++level) {
    launch_combine_scales(view(), *level, stream_);
  }
}

void DeviceTree::sort(const BodyArrays& bodies, const gravity::Root& root, double mass_unit, unsigned first,
                      unsigned own) {
  keys_.reserve(count_);
  order_.reserve(count_);
  own_before_.reserve(std::size_t{count_} + 1);
  sorted_.reserve(4 * std::size_t{count_});
  launch_tree_keys(bodies, root, keys_.data(), order_.data(), stream_);
  radix_sort(keys_, order_, count_, 0, gravity::kKeyBits, scratch_, stream_);
  launch_arrange_bodies(bodies, root, mass_unit, first, own, this->bodies(), own_before_.data(), stream_);
  exclusive_scan(own_before_.data(), count_ + 1, scratch_, stream_);
}

void DeviceTree::grow() {
  cells_in_use_ = 0;
  make_room(1);
  launch_plant(view(), bodies(), stream_);
  cells_in_use_ = 1;
  levels_.assign(1, Level{0, 1});
  for (;;) {
    const Level level = levels_.back();
    children_.reserve(std::size_t{level.count} + 1);
    bounds_.reserve(std::size_t{level.count} * (gravity::kMostChildren + 1));
    bits_.reserve(level.count);
    const Splitting splitting{children_.data(), bounds_.data(), bits_.data()};
    launch_split(view(), bodies(), level, splitting, stream_);
    exclusive_scan(children_.data(), level.count + 1, scratch_, stream_);
    const unsigned children = read_back<unsigned, 1>({children_.data() + level.count}, stream_)[0];
    make_room(cells_in_use_ + children);
    launch_grow(view(), bodies(), level, cells_in_use_, splitting, stream_);
    if (children == 0) return;
    levels_.push_back({cells_in_use_, children});
    cells_in_use_ += children;
  }
}

// Every rank has sampled the groups that hold its bodies. Of the largest double and a scale the scale is less.
void DeviceTree::share_scales() {
  std::vector<double> scales = scale_.download(cells_in_use_, stream_);
  MPI_Allreduce(MPI_IN_PLACE, scales.data(), static_cast<int>(scales.size()), MPI_DOUBLE, MPI_MIN, comm_.handle());
  scale_.upload(scales, stream_);
}

void DeviceTree::make_room(unsigned cells) {
  lengthen(cells_, cells_in_use_, cells, stream_);
  lengthen(next_, cells_in_use_, cells, stream_);
  lengthen(role_, cells_in_use_, cells, stream_);
  lengthen(scale_, 0, cells, stream_);
}

TreeView DeviceTree::view() const { return {cells_.data(), next_.data(), role_.data(), scale_.data(), cells_in_use_}; }

SortedBodies DeviceTree::bodies() const {
  const std::size_t n = count_;
  double* x = sorted_.data();
  return {{x, x + n, x + 2 * n}, x + 3 * n, order_.data(), keys_.data(), own_before_.data(), count_};
}

}  // namespace breccia::cuda

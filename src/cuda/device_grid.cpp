#include "cuda/device_grid.hpp"

#include <array>
#include <bit>

#include "cuda/launchers.hpp"

namespace breccia::cuda {
namespace {

constexpr int kCellBits = 6;  // of a cell in its block
static_assert(grid::kBlockNodes == 1 << kCellBits);

// One number that the host needs to go on.
unsigned number_at(const unsigned* address, cudaStream_t stream) { return read_back(std::array{address}, stream)[0]; }

CompactKeys compact_layout(const PlaceReport& report) {
  CompactKeys keys;
  std::int32_t* corner[3] = {&keys.corner.x, &keys.corner.y, &keys.corner.z};
  for (int axis = 0; axis < 3; ++axis) {
    const int high = report.highest[axis] - grid::kBlockLimit;
    const int low = grid::kBlockLimit - report.lowest[axis];
    *corner[axis] = low;
    keys.bits[axis] = static_cast<int>(std::bit_width(static_cast<unsigned>(high - low)));
  }
  return keys;
}

}  // namespace

template <class P>
void DeviceGrid<P>::set_block_keys(std::span<const grid::BlockKey> keys, cudaStream_t stream) {
  key_of_particle_.reserve(keys.size());
  key_of_particle_.upload(keys, stream);
}

template <class P>
std::vector<grid::BlockKey> DeviceGrid<P>::block_keys_of_particles(cudaStream_t stream) const {
  return key_of_particle_.download(tiled_ + lone_, stream);
}

template <class P>
void DeviceGrid<P>::sort(DeviceParticles<P>& particles, const OwnPlanes& planes, cudaStream_t stream) {
  const unsigned count = particles.count();
  const ParticleView<Real> view = particles.view();
  tiles_ = blocks_ = tiled_ = lone_ = 0;
  if (count == 0) return;
  unsigned too_far = 0;
  const CompactKeys layout = place(particles, too_far, stream);
  if (too_far != 0) throw NumericsError(kTooFar);
  radix_sort(sort_keys_, order_, count, 0, kCellBits, scratch_, stream);
  launch_compact_keys(key_of_particle_.data(), order_.data(), sort_keys_.data(), count, layout, stream);
  radix_sort(sort_keys_, order_, count, 0, layout.all_bits(), scratch_, stream);
  find_runs(count, stream);
  separate(view, count, planes, stream);

  source_.reserve(count);
  next_keys_.reserve(count);
  launch_arrange(runs_, order_.data(), tiled_, source_.data(), next_keys_.data(), stream);
  key_of_particle_.swap(next_keys_);
  tile_first_.reserve(std::size_t{tiles_} + 1);
  block_keys_.reserve(std::size_t{tiles_} * 27);
  launch_list_tiles(runs_, tiles_, tile_first_.data(), block_keys_.data(), stream);
  particles.rearrange(source_.data(), stream);
  connect(view, stream);

  lone_pull_.reserve(std::size_t{lone_} * 6);
  lone_node_.reserve(lone_);
  if (lone_ > 0) {
    check(cudaMemcpyAsync(lone_node_.data(), view.node + tiled_, lone_ * sizeof(std::int32_t), cudaMemcpyDeviceToDevice,
                          stream),
          "copy");
  }
}

template <class P>
CompactKeys DeviceGrid<P>::place(const DeviceParticles<P>& particles, unsigned& too_far, cudaStream_t stream) {
  too_far = 0;
  if (particles.count() == 0) return {};
  sort_keys_.reserve(particles.count());
  order_.reserve(particles.count());
  place_report_.reserve(1);
  place_report_.fill_bytes(0, stream);
  launch_place(particles.view().node, key_of_particle_.data(), sort_keys_.data(), order_.data(), particles.count(),
               periodicity_, place_report_.data(), stream);
  const PlaceReport report = place_report_.download(1, stream)[0];
  too_far = report.too_far;
  return compact_layout(report);
}

template <class P>
void DeviceGrid<P>::find_runs(unsigned count, cudaStream_t stream) {
  run_of_.reserve(std::size_t{count} + 1);
  launch_mark_runs(sort_keys_.data(), run_of_.data(), count, stream);
  exclusive_scan(run_of_.data(), count + 1, scratch_, stream);
  runs_.particles = count;
  runs_.count = number_at(run_of_.data() + count, stream);
  run_first_.reserve(std::size_t{runs_.count} + 1);
  run_key_.reserve(runs_.count);
  run_tiles_.reserve(std::size_t{runs_.count} + 1);
  run_tiled_.reserve(std::size_t{runs_.count} + 1);
  runs_.of = run_of_.data();
  runs_.first = run_first_.data();
  runs_.key = run_key_.data();
  runs_.tiles = run_tiles_.data();
  runs_.tiled = run_tiled_.data();
  launch_list_runs(key_of_particle_.data(), order_.data(), runs_, stream);
}

template <class P>
void DeviceGrid<P>::separate(const ParticleView<Real>& view, unsigned count, const OwnPlanes& planes,
                             cudaStream_t stream) {
  const BlockHash hash = cleared_hash(runs_.count, stream);
  launch_insert_all(runs_.key, runs_.count, hash, stream);
  launch_separate(runs_, hash, view.node, order_.data(), periodicity_, planes, lone_without_grid_, stream);
  exclusive_scan(runs_.tiles, runs_.count + 1, scratch_, stream);
  exclusive_scan(runs_.tiled, runs_.count + 1, scratch_, stream);
  const std::array<const unsigned*, 2> last{runs_.tiles + runs_.count, runs_.tiled + runs_.count};
  const auto [tiles, tiled] = read_back(last, stream);
  tiles_ = tiles;
  tiled_ = tiled;
  lone_ = count - tiled_;
}

template <class P>
void DeviceGrid<P>::connect(const ParticleView<Real>& view, cudaStream_t stream) {
  const BlockHash hash = cleared_hash(std::size_t{tiles_} * 27, stream);
  launch_insert_all(block_keys_.data(), tiles_, hash, stream);
  block_count_.reserve(1);
  check(
      cudaMemcpyAsync(block_count_.data(), runs_.tiles + runs_.count, sizeof tiles_, cudaMemcpyDeviceToDevice, stream),
      "copy");
  launch_reach(tile_first_.data(), tiles_, view.node, periodicity_, hash, block_keys_.data(), block_count_.data(),
               stream);
  blocks_ = number_at(block_count_.data(), stream);
  neighbours_.reserve(std::size_t{blocks_} * 27);
  launch_neighbours(block_keys_.data(), blocks_, periodicity_, hash, neighbours_.data(), stream);
  boxes_.reserve(tiles_);
  partial_sums_.reserve(std::size_t{tiles_} * kSums * kTileNodes);
  velocities_.reserve(std::size_t{blocks_} * kSums * grid::kBlockNodes);
}

template <class P>
BlockHash DeviceGrid<P>::cleared_hash(std::size_t entries, cudaStream_t stream) {
  const std::size_t size = std::bit_ceil(2 * entries + 2);
  hash_keys_.reserve(size);
  hash_indices_.reserve(size);
  hash_keys_.fill_bytes(0xff, stream);
  return {hash_keys_.data(), hash_indices_.data(), static_cast<unsigned>(size - 1)};
}

template <class P>
void DeviceGrid<P>::count_lone_drift(const DeviceParticles<P>& particles, unsigned* strayed,
                                     cudaStream_t stream) const {
  launch_lone_drift(particles.view().node + tiled_, lone_node_.data(), lone_, strayed, stream);
}

template <class P>
GridView<typename P::Real> DeviceGrid<P>::view() const {
  return {.tiles = tiles_,
          .blocks = blocks_,
          .first = tile_first_.data(),
          .neighbours = neighbours_.data(),
          .block_keys = block_keys_.data(),
          .boxes = boxes_.data(),
          .partial_sums = partial_sums_.data(),
          .velocities = velocities_.data()};
}

template <class P>
unsigned DeviceGrid<P>::pass_blocks() const {
  return tiles_ + blocks_for(lone_, kPassThreads);
}

template <class P>
std::size_t DeviceGrid<P>::bytes() const {
  return tile_first_.bytes() + block_keys_.bytes() + neighbours_.bytes() + boxes_.bytes() + partial_sums_.bytes() +
         velocities_.bytes();
}

template class DeviceGrid<MixedPrecision>;
template class DeviceGrid<DoublePrecision>;

}  // namespace breccia::cuda

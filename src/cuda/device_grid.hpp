// The sparse grid in device memory and the sorting that makes it: particles to tiles by block, the blocks they can
// reach found by hash, particles that no other can meet apart.
#pragma once

#include "cuda/device_array.hpp"
#include "cuda/device_particles.hpp"
#include "cuda/primitives.hpp"
#include "cuda/sort_kernels.hpp"
#include "cuda/step_arguments.hpp"

namespace breccia::cuda {

inline constexpr const char* kTooFar = "particles are more than 4 million cells from the origin";

template <class P>
class DeviceGrid {
 public:
  using Real = typename P::Real;

  DeviceGrid(const grid::Periodicity& periodicity, bool lone_without_grid)
      : periodicity_(periodicity), lone_without_grid_(lone_without_grid) {}

  /// Block of each particle, in storage order. Its node field is relative to it.
  void set_block_keys(std::span<const grid::BlockKey> keys, cudaStream_t stream);
  [[nodiscard]] std::vector<grid::BlockKey> block_keys_of_particles(cudaStream_t stream) const;
  /// The same, in device memory.
  [[nodiscard]] const grid::BlockKey* block_keys_of_particles() const { return key_of_particle_.data(); }

  /// Sorts particles and builds tiles and blocks anew. The host waits for counts. Throws NumericsError if a particle is
  /// too far from the origin.
  void sort(DeviceParticles<P>& particles, const OwnPlanes& planes, cudaStream_t stream);
  /// Renews the blocks of the particles without sorting them; `too_far` counts those that have none.
  CompactKeys place(const DeviceParticles<P>& particles, unsigned& too_far, cudaStream_t stream);
  /// Counts lone particles that drifted further than the sorting allowed for into `strayed`.
  void count_lone_drift(const DeviceParticles<P>& particles, unsigned* strayed, cudaStream_t stream) const;

  [[nodiscard]] GridView<Real> view() const;
  [[nodiscard]] std::vector<grid::BlockKey> block_keys(cudaStream_t stream) const {
    return block_keys_.download(blocks_, stream);
  }
  /// Whether particles that no other can meet use no grid.
  [[nodiscard]] bool lone_without_grid() const { return lone_without_grid_; }
  [[nodiscard]] unsigned tiles() const { return tiles_; }
  [[nodiscard]] unsigned blocks() const { return blocks_; }
  [[nodiscard]] unsigned tiled_particles() const { return tiled_; }
  [[nodiscard]] unsigned lone_particles() const { return lone_; }
  [[nodiscard]] Real* lone_pull() const { return lone_pull_.data(); }
  /// Thread blocks of the tile pass and the lone pass.
  [[nodiscard]] unsigned pass_blocks() const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  void find_runs(unsigned count, cudaStream_t stream);
  void separate(const ParticleView<Real>& view, unsigned count, const OwnPlanes& planes, cudaStream_t stream);
  void connect(const ParticleView<Real>& view, cudaStream_t stream);
  BlockHash cleared_hash(std::size_t entries, cudaStream_t stream);

  grid::Periodicity periodicity_;
  bool lone_without_grid_;
  unsigned tiles_ = 0, blocks_ = 0, tiled_ = 0, lone_ = 0;

  DeviceArray<grid::BlockKey> key_of_particle_;
  DeviceArray<unsigned> tile_first_;
  DeviceArray<grid::BlockKey> block_keys_;
  DeviceArray<unsigned> neighbours_;
  DeviceArray<PackedBox> boxes_;
  DeviceArray<Real> partial_sums_;
  DeviceArray<Real> velocities_;
  DeviceArray<Real> lone_pull_;
  DeviceArray<std::int32_t> lone_node_;

  // Only while sorting.
  PrimitiveScratch scratch_;
  DeviceArray<std::uint64_t> sort_keys_;
  DeviceArray<unsigned> order_;
  DeviceArray<unsigned> source_;
  DeviceArray<grid::BlockKey> next_keys_;
  DeviceArray<unsigned> run_of_, run_first_, run_tiles_, run_tiled_;
  DeviceArray<grid::BlockKey> run_key_;
  Runs runs_;
  DeviceArray<unsigned long long> hash_keys_;
  DeviceArray<unsigned> hash_indices_;
  DeviceArray<PlaceReport> place_report_;
  DeviceArray<unsigned> block_count_;
};

extern template class DeviceGrid<MixedPrecision>;
extern template class DeviceGrid<DoublePrecision>;

}  // namespace breccia::cuda

// The census of bodies in the memory of a device: what the host's choice of boxes must know of them, without any of
// them coming to the host.
#pragma once

#include <vector>

#include "cuda/census_kernels.hpp"
#include "cuda/device_array.hpp"
#include "gravity/mesh/census.hpp"

namespace breccia::cuda {

/// The host waits for every answer.
class DeviceCensus final : public gravity::Census {
 public:
  explicit DeviceCensus(cudaStream_t stream) : stream_(stream) {}

  /// Speaks of these bodies from now on, none of which is heavier than `heaviest` [kg].
  void take(const BodyArrays& bodies, double heaviest);
  /// Frees what it holds of the device.
  void forget();

  [[nodiscard]] std::uint64_t particles() const override { return bodies_.count; }
  [[nodiscard]] gravity::Box bounds() override;
  [[nodiscard]] std::vector<gravity::BlockCount> occupied(double width) override;
  void divide(double width) override;
  [[nodiscard]] double mass() override { return sets({})[0].mass; }
  [[nodiscard]] std::vector<gravity::BlockCount> crowded(std::int64_t least) override;
  [[nodiscard]] std::vector<std::int64_t> counts(std::span<const gravity::BlockIndex> blocks) override;
  [[nodiscard]] std::span<const gravity::Block> around(std::span<const gravity::BlockIndex> blocks) override;
  [[nodiscard]] std::vector<gravity::SetSum> sets(std::span<const gravity::Box> boxes) override;

 private:
  [[nodiscard]] BlockTable table() const;
  void send(std::span<const gravity::BlockIndex> blocks);
  // What a kernel counts, from 0.
  template <class Launch>
  unsigned count_found(const Launch& launch);
  [[nodiscard]] double in_kg(unsigned long long quanta) const { return static_cast<double>(quanta) / quanta_per_kg_; }

  cudaStream_t stream_;
  BodyArrays bodies_;
  double quanta_per_kg_ = 1.0;
  double per_width_ = 0.0;
  DeviceArray<unsigned> body_, count_, place_;  // BlockTable
  DeviceArray<unsigned> found_, slots_, counts_;
  DeviceArray<CountedBlock> crowded_;
  DeviceArray<gravity::BlockIndex> asked_;
  DeviceArray<BlockSums> sums_;
  DeviceArray<SetSums> set_sums_;
  DeviceArray<Extremes> extremes_;
  std::vector<gravity::Block> around_;
};

/// Slots of the table for so many bodies: seldom more than two thirds of them are in use.
constexpr std::uint64_t table_slots(std::uint64_t bodies) { return bodies + bodies / 2 + 64; }

}  // namespace breccia::cuda

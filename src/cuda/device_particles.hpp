// The particles of a rank in device memory: an array for each field of grid/particles.hpp that the effects need.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "cuda/device_array.hpp"
#include "cuda/particle_view.hpp"
#include "grid/particles.hpp"

namespace breccia::cuda {

/// Of each particle, so many bytes are rearranged at once and need room beside it.
inline constexpr std::size_t kRearrangedBytes = 32;

/// The fields of grid::fields, but with the state of the flaws in two words: the threshold of the next in full, as
/// every step reads it.
template <class P>
std::span<const grid::FieldDescriptor> device_fields();

template <class P>
class DeviceParticles {
 public:
  using Real = typename P::Real;

  struct Field {
    const grid::FieldDescriptor* descriptor;
    DeviceArray<std::byte> data;
  };

  explicit DeviceParticles(const grid::GroupSet& groups);

  /// Makes room; what was held is lost.
  void allocate(std::size_t count);
  [[nodiscard]] unsigned count() const { return count_; }
  [[nodiscard]] const grid::GroupSet& groups() const { return groups_; }
  [[nodiscard]] const std::vector<Field>& fields() const { return fields_; }
  [[nodiscard]] const Field* find(std::string_view name) const;
  [[nodiscard]] ParticleView<Real> view() const;
  [[nodiscard]] std::size_t bytes() const;

  /// Values particle after particle, its components together, as in EngineState; other way round on the device.
  void upload(const Field& field, const std::byte* values, cudaStream_t stream);
  [[nodiscard]] std::vector<std::byte> download(const Field& field, cudaStream_t stream) const;
  /// One component of a field as numbers.
  template <class T>
  [[nodiscard]] std::vector<T> download_component(std::string_view name, int component, cudaStream_t stream) const;

  /// new slot s holds what source[s] held, source of `count` entries on the device.
  void rearrange(const unsigned* source, cudaStream_t stream);
  /// All fields of some particles, record after record, fields in their order.
  [[nodiscard]] std::size_t record_bytes() const;
  /// Place of a field in a record.
  [[nodiscard]] std::size_t place_in_record(std::string_view name) const;
  [[nodiscard]] std::vector<std::byte> extract(std::span<const unsigned> slots, cudaStream_t stream);
  /// Keeps the particles of `slots` in this order and puts those of the records behind them.
  void replace(std::span<const unsigned> slots, std::span<const std::byte> records, cudaStream_t stream);
  /// Frees what only damage growth needs.
  void drop_damage();

 private:
  grid::GroupSet groups_;
  std::vector<Field> fields_;
  unsigned count_ = 0;
  unsigned stride_ = 0;
  DeviceArray<std::byte> scratch_;
};

extern template class DeviceParticles<MixedPrecision>;
extern template class DeviceParticles<DoublePrecision>;

}  // namespace breccia::cuda

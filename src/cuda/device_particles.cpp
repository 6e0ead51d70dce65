#include "cuda/device_particles.hpp"

#include <cstring>

#include "cuda/sort_kernels.hpp"

namespace breccia::cuda {
namespace {

std::size_t word_bytes(const grid::FieldDescriptor& f) { return static_cast<std::size_t>(f.element_bytes); }
std::size_t components(const grid::FieldDescriptor& f) { return static_cast<std::size_t>(f.components); }

bool exists(const grid::GroupSet& groups, grid::Group group) {
  switch (group) {
    case grid::Group::kElastic:
      return groups.elastic;
    case grid::Group::kEnergy:
      return groups.energy;
    case grid::Group::kDamageLevel:
      return groups.damage_level;
    case grid::Group::kFlaws:
      return groups.flaws;
    case grid::Group::kGravity:
      return groups.gravity;
    default:
      return true;
  }
}

template <class P>
std::vector<grid::FieldDescriptor> make_device_fields() {
  std::vector<grid::FieldDescriptor> fields;
  for (const grid::FieldDescriptor& f : grid::fields<P>()) {
    if (f.name != std::string_view("flaw_state")) {
      fields.push_back(f);
      continue;
    }
    fields.push_back({"flaw_count", "", "active + 65536 * all", f.group, 0, 4, 1});
    fields.push_back({"next_threshold", "", "strain that activates the next flaw", f.group, 0,
                      static_cast<int>(sizeof(typename P::Real)), 1});
  }
  return fields;
}

}  // namespace

template <class P>
std::span<const grid::FieldDescriptor> device_fields() {
  static const std::vector<grid::FieldDescriptor> table = make_device_fields<P>();
  return table;
}

template <class P>
DeviceParticles<P>::DeviceParticles(const grid::GroupSet& groups) : groups_(groups) {
  for (const grid::FieldDescriptor& descriptor : device_fields<P>()) {
    if (exists(groups_, descriptor.group)) fields_.push_back({&descriptor, {}});
  }
}

template <class P>
void DeviceParticles<P>::allocate(std::size_t count) {
  if (count > 0xffffffffU / 9) throw NumericsError("a device holds at most 477 million particles: use more ranks");
  count_ = static_cast<unsigned>(count);
  stride_ = count_;
  for (Field& field : fields_) {
    field.data.allocate(count * word_bytes(*field.descriptor) * components(*field.descriptor));
  }
  scratch_.allocate(count * kRearrangedBytes);
}

template <class P>
auto DeviceParticles<P>::find(std::string_view name) const -> const Field* {
  for (const Field& field : fields_) {
    if (field.descriptor->name == name) return &field;
  }
  return nullptr;
}

template <class P>
ParticleView<typename P::Real> DeviceParticles<P>::view() const {
  ParticleView<Real> v;
  v.stride = stride_;
  const auto bind = [&](const char* name, auto*& pointer) {
    const Field* field = find(name);
    if (field != nullptr) pointer = reinterpret_cast<std::remove_reference_t<decltype(pointer)>>(field->data.data());
  };
  bind("offset", v.offset);
  bind("node", v.node);
  bind("velocity", v.velocity);
  bind("mass", v.mass);
  bind("volume_change", v.volume_change);
  bind("kirchhoff_pressure", v.kirchhoff_pressure);
  bind("elastic_strain", v.elastic_strain);
  bind("internal_energy", v.internal_energy);
  bind("damage_root", v.damage_root);
  bind("total_strain", v.total_strain);
  bind("next_threshold", v.next_threshold);
  bind("flaw_first", v.flaw_first);
  bind("flaw_count", v.flaw_count);
  bind("gravity", v.gravity);
  bind("id_low", v.id_low);
  bind("id_high", v.id_high);
  bind("body_material", v.body_material);
  bind("velocity_gradient", v.velocity_gradient);
  return v;
}

template <class P>
std::size_t DeviceParticles<P>::bytes() const {
  std::size_t bytes = scratch_.bytes();
  for (const Field& field : fields_) bytes += field.data.bytes();
  return bytes;
}

template <class P>
void DeviceParticles<P>::upload(const Field& field, const std::byte* values, cudaStream_t stream) {
  const std::size_t word = word_bytes(*field.descriptor);
  const std::size_t width = components(*field.descriptor);
  std::vector<std::byte> planes(count_ * word * width);
  for (std::size_t i = 0; i < count_; ++i) {
    for (std::size_t c = 0; c < width; ++c) {
      std::memcpy(planes.data() + (c * count_ + i) * word, values + (i * width + c) * word, word);
    }
  }
  if (planes.empty()) return;
  check(cudaMemcpyAsync(field.data.data(), planes.data(), planes.size(), cudaMemcpyHostToDevice, stream), "upload");
  check(cudaStreamSynchronize(stream), "upload");
}

template <class P>
std::vector<std::byte> DeviceParticles<P>::download(const Field& field, cudaStream_t stream) const {
  const std::size_t word = word_bytes(*field.descriptor);
  const std::size_t width = components(*field.descriptor);
  const std::vector<std::byte> planes = field.data.download(count_ * word * width, stream);
  std::vector<std::byte> values(planes.size());
  for (std::size_t i = 0; i < count_; ++i) {
    for (std::size_t c = 0; c < width; ++c) {
      std::memcpy(values.data() + (i * width + c) * word, planes.data() + (c * count_ + i) * word, word);
    }
  }
  return values;
}

template <class P>
template <class T>
std::vector<T> DeviceParticles<P>::download_component(std::string_view name, int component, cudaStream_t stream) const {
  std::vector<T> values(count_);
  const Field* field = find(name);
  if (field == nullptr || count_ == 0) return values;
  const std::byte* from = field->data.data() + static_cast<std::size_t>(component) * count_ * sizeof(T);
  check(cudaMemcpyAsync(values.data(), from, count_ * sizeof(T), cudaMemcpyDeviceToHost, stream), "download");
  check(cudaStreamSynchronize(stream), "download");
  return values;
}

template <class P>
void DeviceParticles<P>::rearrange(const unsigned* source, cudaStream_t stream) {
  static_assert(kRearrangedBytes / sizeof(std::uint32_t) <= Planes::kMost);
  Planes there, back;
  const auto move = [&] {
    launch_gather(there, source, count_, stream);
    launch_gather(back, nullptr, count_, stream);
    there = back = {};
  };
  for (Field& field : fields_) {
    const std::size_t word = word_bytes(*field.descriptor);
    for (std::size_t c = 0; c < components(*field.descriptor); ++c) {
      const std::size_t bytes = word * count_;
      const bool full = static_cast<std::size_t>(there.count + 1) * word > kRearrangedBytes;
      if (there.count > 0 && (full || there.word_bytes != field.descriptor->element_bytes)) move();
      there.word_bytes = back.word_bytes = field.descriptor->element_bytes;
      std::byte* plane = field.data.data() + c * bytes;
      std::byte* aside = scratch_.data() + static_cast<std::size_t>(there.count) * bytes;
      there.add(plane, aside);
      back.add(aside, plane);
    }
  }
  move();
}

template <class P>
std::size_t DeviceParticles<P>::record_bytes() const {
  std::size_t bytes = 0;
  for (const Field& field : fields_) bytes += word_bytes(*field.descriptor) * components(*field.descriptor);
  return bytes;
}

template <class P>
std::size_t DeviceParticles<P>::place_in_record(std::string_view name) const {
  std::size_t place = 0;
  for (const Field& field : fields_) {
    if (field.descriptor->name == name) break;
    place += word_bytes(*field.descriptor) * components(*field.descriptor);
  }
  return place;
}

template <class P>
std::vector<std::byte> DeviceParticles<P>::extract(std::span<const unsigned> slots, cudaStream_t stream) {
  const std::size_t record = record_bytes();
  std::vector<std::byte> records(slots.size() * record);
  if (slots.empty()) return records;
  DeviceArray<unsigned> source(slots.size());
  source.upload(slots, stream);
  std::size_t place = 0;
  for (const Field& field : fields_) {
    const std::size_t word = word_bytes(*field.descriptor);
    for (std::size_t c = 0; c < components(*field.descriptor); ++c, place += word) {
      Planes planes{.word_bytes = field.descriptor->element_bytes};
      planes.add(field.data.data() + c * count_ * word, scratch_.data());
      launch_gather(planes, source.data(), static_cast<unsigned>(slots.size()), stream);
      const std::vector<std::byte> plane = scratch_.download(slots.size() * word, stream);
      for (std::size_t i = 0; i < slots.size(); ++i) {
        std::memcpy(records.data() + i * record + place, plane.data() + i * word, word);
      }
    }
  }
  return records;
}

template <class P>
void DeviceParticles<P>::replace(std::span<const unsigned> slots, std::span<const std::byte> records,
                                 cudaStream_t stream) {
  const std::size_t record = record_bytes();
  const std::size_t arrivals = records.size() / record;
  const std::size_t count = slots.size() + arrivals;
  DeviceArray<unsigned> source(slots.size());
  source.upload(slots, stream);
  std::size_t place = 0;
  std::vector<std::byte> plane;
  for (Field& field : fields_) {
    const std::size_t word = word_bytes(*field.descriptor);
    DeviceArray<std::byte> data(count * word * components(*field.descriptor));
    for (std::size_t c = 0; c < components(*field.descriptor); ++c, place += word) {
      std::byte* to = data.data() + c * count * word;
      Planes planes{.word_bytes = field.descriptor->element_bytes};
      planes.add(field.data.data() + c * count_ * word, to);
      launch_gather(planes, source.data(), static_cast<unsigned>(slots.size()), stream);
      if (arrivals == 0) continue;
      plane.resize(arrivals * word);
      for (std::size_t i = 0; i < arrivals; ++i) {
        std::memcpy(plane.data() + i * word, records.data() + i * record + place, word);
      }
      check(cudaMemcpyAsync(to + slots.size() * word, plane.data(), plane.size(), cudaMemcpyHostToDevice, stream),
            "upload");
      check(cudaStreamSynchronize(stream), "upload");
    }
    field.data = std::move(data);
  }
  count_ = static_cast<unsigned>(count);
  stride_ = count_;
  scratch_.reserve(count * kRearrangedBytes);
}

template <class P>
void DeviceParticles<P>::drop_damage() {
  groups_.flaws = false;
  groups_.damage_level = false;
  std::erase_if(fields_, [&](const Field& field) { return !exists(groups_, field.descriptor->group); });
}

template std::span<const grid::FieldDescriptor> device_fields<MixedPrecision>();
template std::span<const grid::FieldDescriptor> device_fields<DoublePrecision>();
template class DeviceParticles<MixedPrecision>;
template class DeviceParticles<DoublePrecision>;
template std::vector<float> DeviceParticles<MixedPrecision>::download_component(std::string_view, int,
                                                                                cudaStream_t) const;
template std::vector<std::int32_t> DeviceParticles<MixedPrecision>::download_component(std::string_view, int,
                                                                                       cudaStream_t) const;
template std::vector<double> DeviceParticles<DoublePrecision>::download_component(std::string_view, int,
                                                                                  cudaStream_t) const;
template std::vector<std::int32_t> DeviceParticles<DoublePrecision>::download_component(std::string_view, int,
                                                                                        cudaStream_t) const;

}  // namespace breccia::cuda

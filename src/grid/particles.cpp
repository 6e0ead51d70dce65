#include "grid/particles.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

namespace breccia::grid {
namespace {

// Zeroes the packs from `first` on; an empty rank has none.
template <class T>
void clear(LargeArray<T>& packs, std::size_t first) {
  if (packs.size() > first) {
    std::memset(static_cast<void*>(packs.data() + first), 0, (packs.size() - first) * sizeof(T));
  }
}

// The components of a field for all lanes of one pack: each lane from where `lane[l]` points to, components a pack
// apart.
template <class Element, std::size_t kLanes>
void gather_components(const std::byte* const (&lane)[kLanes], std::byte* to, int components) {
  for (int c = 0; c < components; ++c) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      std::memcpy(to + l * sizeof(Element), lane[l] + static_cast<std::size_t>(c) * kLanes * sizeof(Element),
                  sizeof(Element));
    }
    to += kLanes * sizeof(Element);
  }
}

// What the lanes of pack p are to hold.
template <class P>
std::span<const std::uint32_t, P::kLanes> lanes_of(std::span<const std::uint32_t> source, std::size_t p) {
  return source.subspan(p * P::kLanes).template first<P::kLanes>();
}

// One pack of a group, each lane from source[lane]. `old(pack)` is where a pack of before is found.
template <class P, class T, class F>
void gather_pack(std::span<const std::uint32_t, P::kLanes> source, std::span<const FieldDescriptor> table, F&& old,
                 T& pack) {
  constexpr std::size_t kLanes = P::kLanes;
  static const T kNothing{};  // of an empty lane
  const T* from[kLanes];
  std::size_t from_lane[kLanes];
  for (std::size_t l = 0; l < kLanes; ++l) {
    const std::uint32_t s = source[l];
    from[l] = s == ParticleStore<P>::kEmpty ? &kNothing : old(s / kLanes);
    from_lane[l] = s % kLanes;
  }
  for (const FieldDescriptor& field : table) {
    const auto element = static_cast<std::size_t>(field.element_bytes);
    const std::byte* lane[kLanes];
    for (std::size_t l = 0; l < kLanes; ++l) {
      lane[l] = reinterpret_cast<const std::byte*>(from[l]) + field.offset + from_lane[l] * element;
    }
    std::byte* to = reinterpret_cast<std::byte*>(&pack) + field.offset;
    if (element == sizeof(std::uint32_t)) {
      gather_components<std::uint32_t>(lane, to, field.components);
    } else {
      gather_components<std::uint64_t>(lane, to, field.components);
    }
  }
}

// How far from its new place, in packs, a particle lies at most.
struct Displacement {
  std::size_t back = 0;   // before it
  std::size_t ahead = 0;  // behind it
};

template <class P>
Displacement displacement_of(std::span<const std::uint32_t> source, int threads) {
  std::size_t back = 0;
  std::size_t ahead = 0;
#pragma omp parallel for schedule(static) num_threads(threads) reduction(max : back, ahead)
  for (std::size_t s = 0; s < source.size(); ++s) {
    if (source[s] == ParticleStore<P>::kEmpty) continue;
    const std::size_t to = s / P::kLanes;
    const std::size_t from = source[s] / P::kLanes;
    if (from < to) back = std::max(back, to - from);
    if (from > to) ahead = std::max(ahead, from - to);
  }
  return {back, ahead};
}

// A stretch of packs that is rearranged in place, front to back: what is overwritten before it is needed waits in a
// ring, and what the stretch behind this one overwrites is set aside before.
template <class P, class T>
class Stretch {
 public:
  Stretch(const LargeArray<T>& packs, std::size_t first, std::size_t last, Displacement d)
      : first_(first), last_(last), ring_(d.back + 1) {
    for (std::size_t p = first > d.back ? first - d.back : 0; p < first; ++p) ring_[p % ring_.size()] = packs[p];
    const std::size_t end = std::min(last + d.ahead, packs.size());
    if (end > last) behind_.assign(packs.data() + last, packs.data() + end);
  }

  void rearrange(LargeArray<T>& packs, std::span<const std::uint32_t> source, std::span<const FieldDescriptor> table) {
    for (std::size_t p = first_; p < last_; ++p) {
      ring_[p % ring_.size()] = packs[p];
      const auto old = [&](std::size_t q) {
        return q <= p ? &ring_[q % ring_.size()] : q < last_ ? &packs[q] : &behind_[q - last_];
      };
      gather_pack<P>(lanes_of<P>(source, p), table, old, packs[p]);
    }
  }

  [[nodiscard]] std::size_t bytes() const { return (ring_.capacity() + behind_.capacity()) * sizeof(T); }

 private:
  std::size_t first_, last_;
  LargeArray<T> ring_;
  LargeArray<T> behind_;
};

// The packs of one group of fields, each slot s from source[s]. Returns the bytes held beside them meanwhile.
template <class P, class T>
std::size_t rearrange(LargeArray<T>& packs, std::span<const std::uint32_t> source, Group group, Displacement d,
                      int threads) {
  std::vector<FieldDescriptor> table;
  for (const FieldDescriptor& field : fields<P>()) {
    if (field.group == group) table.push_back(field);
  }
  const std::size_t after = source.size() / P::kLanes;
  const std::size_t most = std::max(after, packs.size());
  // Some room for the next sortings, not twice as much as push_back would take.
  if (most > packs.capacity()) packs.reserve(most + most / 16);
  packs.resize(most);
  const auto count = static_cast<std::size_t>(threads);
  std::size_t beside = 0;
  if (count * (d.back + d.ahead + 1) > packs.size()) {
    // Particles that come from anywhere, of other ranks or without grid until now: a copy is less.
    LargeArray<T> before(packs.size());
#pragma omp parallel num_threads(threads)
    {
#pragma omp for schedule(static)
      for (std::size_t p = 0; p < packs.size(); ++p) before[p] = packs[p];
#pragma omp for schedule(static)
      for (std::size_t p = 0; p < after; ++p) {
        gather_pack<P>(
            lanes_of<P>(source, p), table, [&](std::size_t q) { return &before[q]; }, packs[p]);
      }
    }
    beside = before.size() * sizeof(T);
  } else {
    std::vector<std::unique_ptr<Stretch<P, T>>> stretches(count);
#pragma omp parallel for schedule(static, 1) num_threads(threads)
    for (std::size_t n = 0; n < count; ++n) {
      stretches[n] = std::make_unique<Stretch<P, T>>(packs, n * after / count, (n + 1) * after / count, d);
    }
#pragma omp parallel for schedule(static, 1) num_threads(threads)
    for (std::size_t n = 0; n < count; ++n) stretches[n]->rearrange(packs, source, table);
    for (const auto& stretch : stretches) beside += stretch->bytes();
  }
  packs.resize(after);
  return beside;
}

template <class P>
std::vector<FieldDescriptor> make_fields() {
  constexpr int real = sizeof(typename P::Real);
  constexpr int offset = sizeof(typename P::Offset);
  constexpr int accumulated =
      static_cast<int>(sizeof(Accumulator<typename P::RealPack>) / sizeof(typename P::RealPack));
  using K = Kinematics<P>;
  using V = Volume<P>;
  using F = Flaws<P>;
  using I = Identity<P>;
  return {
      {"offset", "cell", "position inside the cell, from the nearest node", Group::kKinematics, offsetof(K, offset),
       offset, 3},
      {"node", "", "nearest node inside the tile, 3 x 8 bits", Group::kKinematics, offsetof(K, node), 4, 1},
      {"velocity", "m/s", "velocity at the half step", Group::kKinematics, offsetof(K, velocity), real, 3},
      {"mass", "kg", "mass", Group::kKinematics, offsetof(K, mass), real, 1},
      {"volume_change", "", "J - 1, as a sum without loss", Group::kVolume, offsetof(V, change), real, accumulated},
      {"kirchhoff_pressure", "Pa", "J P of the last stress", Group::kVolume, offsetof(V, kirchhoff_pressure), real, 1},
      {"elastic_strain", "", "b_e / (tr b_e / 3) - I, traceless", Group::kElastic, 0, real, 5},
      {"internal_energy", "J/kg", "specific internal energy, as a sum without loss", Group::kEnergy, 0, real,
       accumulated},
      {"damage_root", "", "cube root of the damage", Group::kDamageLevel, 0, real, 1},
      {"total_strain", "", "F F^T - I of the total deformation", Group::kFlaws, offsetof(F, total), real, 6},
      {"flaw_first", "", "place of the flaws in the arena of this rank", Group::kFlaws, offsetof(F, first), 4, 1},
      {"flaw_state", "", "active + 256 * all + 65536 * code of the next", Group::kFlaws, offsetof(F, state), 4, 1},
      {"gravity", "m/s2", "acceleration held over the window", Group::kGravity, 0, real, 3},
      {"id_low", "", "global id, low half", Group::kIdentity, offsetof(I, id_low), 4, 1},
      {"id_high", "", "global id, high half", Group::kIdentity, offsetof(I, id_high), 4, 1},
      {"body_material", "", "body + 65536 * material", Group::kIdentity, offsetof(I, body_material), 4, 1},
      {"velocity_gradient", "1/s", "C at the half step", Group::kAffine, 0, real, 9},
  };
}

}  // namespace

template <class P>
std::span<const FieldDescriptor> fields() {
  static const std::vector<FieldDescriptor> table = make_fields<P>();
  return table;
}

template <class P>
bool ParticleStore<P>::has(Group group) const {
  switch (group) {
    case Group::kElastic:
      return groups_.elastic;
    case Group::kEnergy:
      return groups_.energy;
    case Group::kDamageLevel:
      return groups_.damage_level;
    case Group::kFlaws:
      return groups_.flaws;
    case Group::kGravity:
      return groups_.gravity;
    default:
      return true;
  }
}

template <class P>
template <class F>
void ParticleStore<P>::for_each_group(F&& visit) {
  visit(Group::kKinematics, kinematics);
  visit(Group::kVolume, volume);
  if (groups_.elastic) visit(Group::kElastic, elastic);
  if (groups_.energy) visit(Group::kEnergy, energy);
  if (groups_.damage_level) visit(Group::kDamageLevel, damage_level);
  if (groups_.flaws) visit(Group::kFlaws, flaws);
  if (groups_.gravity) visit(Group::kGravity, gravity);
  visit(Group::kIdentity, identity);
  visit(Group::kAffine, affine);
}

template <class P>
void ParticleStore<P>::allocate(std::size_t packs) {
  for_each_group([&](Group, auto& array) {
    array.resize(packs);
    clear(array, 0);
  });
}

template <class P>
void ParticleStore<P>::append_packs(std::size_t count) {
  for_each_group([&](Group, auto& array) {
    const std::size_t old = array.size();
    array.resize(old + count);
    clear(array, old);
  });
}

template <class P>
void ParticleStore<P>::drop_damage() {
  groups_.flaws = false;
  groups_.damage_level = false;
  release(flaws);
  release(damage_level);
}

template <class P>
void ParticleStore<P>::hold_gradients() {
  affine.resize(packs());
}

template <class P>
void ParticleStore<P>::drop_gradients() {
  release(affine);
}

template <class P>
std::size_t ParticleStore<P>::bytes() const {
  std::size_t bytes = 0;
  const_cast<ParticleStore*>(this)->for_each_group(
      [&](Group group, const auto& array) { bytes += array.size() * stride(group); });
  return bytes;
}

template <class P>
std::byte* ParticleStore<P>::data(Group group) {
  std::byte* result = nullptr;
  for_each_group([&](Group g, auto& array) {
    if (g == group) result = reinterpret_cast<std::byte*>(array.data());
  });
  return result;
}

template <class P>
std::size_t ParticleStore<P>::stride(Group group) {
  switch (group) {
    case Group::kKinematics:
      return sizeof(Kinematics<P>);
    case Group::kVolume:
      return sizeof(Volume<P>);
    case Group::kElastic:
      return sizeof(Elastic<P>);
    case Group::kEnergy:
      return sizeof(Energy<P>);
    case Group::kDamageLevel:
      return sizeof(DamageLevel<P>);
    case Group::kFlaws:
      return sizeof(Flaws<P>);
    case Group::kGravity:
      return sizeof(HeldGravity<P>);
    case Group::kIdentity:
      return sizeof(Identity<P>);
    case Group::kAffine:
      return sizeof(Affine<P>);
  }
  return 0;
}

template <class P>
std::size_t ParticleStore<P>::bytes_per_particle(const GroupSet& groups) {
  const ParticleStore probe(groups);
  std::size_t bytes = 0;
  for (int g = 0; g < kGroupCount; ++g) {
    if (probe.has(static_cast<Group>(g))) bytes += stride(static_cast<Group>(g));
  }
  return bytes / kLanes;
}

template <class P>
std::size_t ParticleStore<P>::gather(std::span<const std::uint32_t> source, int threads) {
  const Displacement d = displacement_of<P>(source, threads);
  std::size_t beside = 0;
  for_each_group(
      [&](Group group, auto& array) { beside = std::max(beside, rearrange<P>(array, source, group, d, threads)); });
  return beside;
}

template <class P>
std::size_t ParticleStore<P>::record_bytes() const {
  std::size_t bytes = 0;
  for (const FieldDescriptor& field : fields<P>()) {
    if (has(field.group)) bytes += static_cast<std::size_t>(field.element_bytes * field.components);
  }
  return bytes;
}

template <class P>
void ParticleStore<P>::read_record(std::size_t slot, std::byte* record) {
  for (const FieldDescriptor& field : fields<P>()) {
    if (!has(field.group)) continue;
    const auto element = static_cast<std::size_t>(field.element_bytes);
    const std::byte* lane =
        data(field.group) + slot / kLanes * stride(field.group) + field.offset + slot % kLanes * element;
    for (int c = 0; c < field.components; ++c, record += element, lane += element * kLanes) {
      std::memcpy(record, lane, element);
    }
  }
}

template <class P>
void ParticleStore<P>::write_record(std::size_t slot, const std::byte* record) {
  for (const FieldDescriptor& field : fields<P>()) {
    if (!has(field.group)) continue;
    const auto element = static_cast<std::size_t>(field.element_bytes);
    std::byte* lane = data(field.group) + slot / kLanes * stride(field.group) + field.offset + slot % kLanes * element;
    for (int c = 0; c < field.components; ++c, record += element, lane += element * kLanes) {
      std::memcpy(lane, record, element);
    }
  }
}

template std::span<const FieldDescriptor> fields<MixedPrecision>();
template std::span<const FieldDescriptor> fields<DoublePrecision>();
template class ParticleStore<MixedPrecision>;
template class ParticleStore<DoublePrecision>;

}  // namespace breccia::grid

// Particles as the engine holds them: arrays of packs (AoSoA), one array for each group of fields that an effect needs.
// A group of an effect that is off has no memory. Lanes are particles; a tile starts on a pack of its own, and lanes
// behind its last particle have mass 0.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "breccia/huge_pages.hpp"
#include "breccia/precision.hpp"
#include "material/flaw_codes.hpp"

namespace breccia::grid {

template <class P>
using OffsetPack = Pack<typename P::Offset, P::kLanes>;

/// Where a particle is and how it moves. Position = (node + offset) * cell, offset in [-1/2, 1/2) cells.
template <class P>
struct Kinematics {
  OffsetPack<P> offset[3];           ///< mixed: int32 in units of 2^-32 cells; double: cells
  typename P::IntPack node;          ///< nearest node inside the tile: 3 x 8 bits, each + kNodeBias
  typename P::RealPack velocity[3];  ///< v^{n-1/2} [m/s]
  typename P::RealPack mass;         ///< [kg], 0 in empty lanes
};

/// J - 1 without loss, and the J P that rebuilds the stress of the last call.
template <class P>
struct Volume {
  Accumulator<typename P::RealPack> change;
  typename P::RealPack kirchhoff_pressure;  ///< [Pa]
};

/// Traceless elastic strain E = b_e / (tr b_e / 3) - I.
template <class P>
struct Elastic {
  typename P::RealPack strain[5];
};

/// Specific internal energy without loss [J/kg].
template <class P>
struct Energy {
  Accumulator<typename P::RealPack> specific;
};

/// D^(1/3).
template <class P>
struct DamageLevel {
  typename P::RealPack root;
};

/// How many flaws grow, how many there are, and the code of the threshold that activates the next one, in one word.
struct FlawState {
  static constexpr std::int32_t kMostFlaws = 255;
  std::int32_t active, all;
  material::FlawCode next;  ///< kNeverGrows if all grow

  [[nodiscard]] BRECCIA_HD std::int32_t packed() const {
    return static_cast<std::int32_t>(std::uint32_t{next} << 16) | all << 8 | active;
  }
  BRECCIA_HD static FlawState of(std::int32_t packed) {
    const auto next = static_cast<material::FlawCode>(static_cast<std::uint32_t>(packed) >> 16);
    return {packed & 255, packed >> 8 & 255, next};
  }
};

/// What damage growth needs while D < 1: total deformation F F^T - I and the flaws of the particle.
template <class P>
struct Flaws {
  typename P::RealPack total[6];
  typename P::IntPack first;  ///< place of the particle's codes in the rank's flaw arena
  typename P::IntPack state;  ///< FlawState
};

/// Gravity held over a window [m/s2].
template <class P>
struct HeldGravity {
  typename P::RealPack acceleration[3];
};

/// Global id in two halves; body + 65536 * material.
template <class P>
struct Identity {
  typename P::IntPack id_low;
  typename P::IntPack id_high;
  typename P::IntPack body_material;
};

/// Velocity gradient C^{n-1/2} [1/s], row by row. Filled only where a step is taken in two halves (window
/// starts), and held only there if no particle is alone and nodes are few.
template <class P>
struct Affine {
  typename P::RealPack gradient[9];
};

/// Which groups exist.
struct GroupSet {
  bool elastic = false;
  bool energy = false;
  bool damage_level = false;
  bool flaws = false;
  bool gravity = false;
};

enum class Group { kKinematics, kVolume, kElastic, kEnergy, kDamageLevel, kFlaws, kGravity, kIdentity, kAffine };
inline constexpr int kGroupCount = 9;

/// One field as declared: everything that copies, sends or saves particles follows from this table.
struct FieldDescriptor {
  const char* name;
  const char* unit;
  const char* meaning;
  Group group;
  std::size_t offset;  ///< bytes from the start of the group's pack
  int element_bytes;
  int components;  ///< consecutive packs
};

/// The descriptor table of a precision policy.
template <class P>
std::span<const FieldDescriptor> fields();

/// The arrays themselves. A slot is pack * lanes + lane.
template <class P>
class ParticleStore {
 public:
  static constexpr std::size_t kLanes = P::kLanes;

  explicit ParticleStore(const GroupSet& groups) : groups_(groups) {}

  /// Sets the number of packs; new packs are zero, old content is lost.
  void allocate(std::size_t packs);
  [[nodiscard]] std::size_t packs() const { return kinematics.size(); }
  [[nodiscard]] const GroupSet& groups() const { return groups_; }
  [[nodiscard]] bool has(Group group) const;
  /// Start of a group's array and the bytes from pack to pack.
  [[nodiscard]] std::byte* data(Group group);
  [[nodiscard]] const std::byte* data(Group group) const { return const_cast<ParticleStore*>(this)->data(group); }
  [[nodiscard]] static std::size_t stride(Group group);
  /// Bytes of all fields of one particle.
  [[nodiscard]] static std::size_t bytes_per_particle(const GroupSet& groups);
  /// Frees what only damage growth needs, once every particle has D = 1.
  void drop_damage();
  /// Room for the velocity gradients of all packs, for whoever writes them next; frees it.
  void hold_gradients();
  void drop_gradients();
  /// Of all arrays, without the room behind them that nothing has touched.
  [[nodiscard]] std::size_t bytes() const;

  /// Rearranges: new slot s holds what old slot source[s] held; kEmpty makes an empty lane. source.size() is a multiple
  /// of the lanes. One group at a time. In place where no particle comes from far, so that the memory needed beside the
  /// particles is that of the packs between old and new places; else with a copy of the group. Returns these bytes.
  std::size_t gather(std::span<const std::uint32_t> source, int threads);
  static constexpr std::uint32_t kEmpty = 0xffffffffU;

  /// All fields of one slot as consecutive bytes, and back.
  [[nodiscard]] std::size_t record_bytes() const;
  void read_record(std::size_t slot, std::byte* record);
  void write_record(std::size_t slot, const std::byte* record);
  /// Adds empty packs at the end, keeping the others.
  void append_packs(std::size_t count);

  LargeArray<Kinematics<P>> kinematics;
  LargeArray<Volume<P>> volume;
  LargeArray<Elastic<P>> elastic;
  LargeArray<Energy<P>> energy;
  LargeArray<DamageLevel<P>> damage_level;
  LargeArray<Flaws<P>> flaws;
  LargeArray<HeldGravity<P>> gravity;
  LargeArray<Identity<P>> identity;
  LargeArray<Affine<P>> affine;

 private:
  template <class F>
  void for_each_group(F&& visit);

  GroupSet groups_;
};

extern template class ParticleStore<MixedPrecision>;
extern template class ParticleStore<DoublePrecision>;

}  // namespace breccia::grid

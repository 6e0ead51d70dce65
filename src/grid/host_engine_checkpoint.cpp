// The whole state of the engine out of its arrays and back into them. Both at a state boundary, just after a sorting:
// tiles, blocks and halo then follow from the particles' nodes and order alone, and no lane holds anything besides.
#include <algorithm>
#include <cstring>
#include <utility>

#include "grid/host_engine.hpp"
#include "grid/state_columns.hpp"

namespace breccia::grid {

template <class P>
EngineState HostEngine<P>::save() const {
  EngineState state;
  const std::vector<Placement> placements = place_all();
  state.particles = placements.size();
  for (const Placement& p : placements) state.node.insert(state.node.end(), std::begin(p.node), std::end(p.node));
  for (const FieldDescriptor& field : fields<P>()) {
    if (!store_.has(field.group) || !saved_as_it_is(field)) continue;
    StateColumn column = column_for(field, placements.size());
    const std::byte* const packs = store_.data(field.group) + field.offset;
    const std::size_t stride = ParticleStore<P>::stride(field.group);
    std::byte* to = column.values.data();
    for (const Placement& p : placements) {
      const std::byte* from = packs + p.slot / kLanes * stride + p.slot % kLanes * column.element_bytes;
      for (std::size_t c = 0; c < column.components; ++c, to += column.element_bytes) {
        std::memcpy(to, from + c * kLanes * column.element_bytes, column.element_bytes);
      }
    }
    state.columns.push_back(std::move(column));
  }
  if (store_.has(Group::kFlaws)) save_flaws(placements, state);
  state.damage_finished = setup_.effects.fully_damaged;
  state.smallest_mass = smallest_mass_;
  state.slab_axis = slabs_.axis();
  state.slab_cuts = slabs_.cuts();
  return state;
}

template <class P>
void HostEngine<P>::save_flaws(std::span<const Placement> placements, EngineState& state) const {
  StateColumn active{kActiveFlaws, "", "flaws that grow", 4, 1, {}};
  for (const Placement& p : placements) {
    const Flaws<P>& f = store_.flaws[p.slot / kLanes];
    const int lane = static_cast<int>(p.slot % kLanes);
    const auto growing = static_cast<std::uint32_t>(f.count[lane] & 0xffff);
    const auto* bytes = reinterpret_cast<const std::byte*>(&growing);
    active.values.insert(active.values.end(), bytes, bytes + sizeof growing);
    const std::int32_t all = f.count[lane] >> 16;
    state.flaw_count.push_back(static_cast<std::uint32_t>(all));
    const auto first = flaw_thresholds_.begin() + f.first[lane];
    state.flaw_thresholds.insert(state.flaw_thresholds.end(), first, first + all);
  }
  state.columns.push_back(std::move(active));
}

template <class P>
void HostEngine<P>::restore(const EngineState& state) {
  if (state.damage_finished && setup_.effects.damage) switch_damage_off();
  store_.allocate((state.particles + kLanes - 1) / kLanes);
  std::vector<Placement> placements(state.particles);
  for (std::size_t i = 0; i < placements.size(); ++i) {
    placements[i].slot = static_cast<std::uint32_t>(i);
    std::copy_n(state.node.data() + 3 * i, 3, std::begin(placements[i].node));
  }
  for (const FieldDescriptor& field : fields<P>()) {
    if (!store_.has(field.group) || !saved_as_it_is(field)) continue;
    const auto element = static_cast<std::size_t>(field.element_bytes);
    const auto components = static_cast<std::size_t>(field.components);
    const std::byte* from = find_column(state, field.name, element, components).values.data();
    std::byte* const packs = store_.data(field.group) + field.offset;
    const std::size_t stride = ParticleStore<P>::stride(field.group);
    for (std::size_t i = 0; i < placements.size(); ++i) {
      std::byte* to = packs + i / kLanes * stride + i % kLanes * element;
      for (std::size_t c = 0; c < components; ++c, from += element)
        std::memcpy(to + c * kLanes * element, from, element);
    }
  }
  if (store_.has(Group::kFlaws)) restore_flaws(state);
  smallest_mass_ = state.smallest_mass;
  if (state.same_ranks) {
    slabs_ = mpi::Slabs(state.slab_axis, state.slab_cuts);
    slabs_chosen_ = true;
  } else {
    choose_slabs(placements);
  }
  settle_in_slabs(std::move(placements));
}

template <class P>
void HostEngine<P>::restore_flaws(const EngineState& state) {
  const std::byte* active = find_column(state, kActiveFlaws, 4, 1).values.data();
  flaw_thresholds_ = state.flaw_thresholds;
  std::size_t first = 0;
  for (std::size_t i = 0; i < state.particles; ++i) {
    Flaws<P>& f = store_.flaws[i / kLanes];
    const int lane = static_cast<int>(i % kLanes);
    std::int32_t growing = 0;
    std::memcpy(&growing, active + i * sizeof growing, sizeof growing);
    f.first.set(lane, static_cast<std::int32_t>(first));
    f.count.set(lane, growing | static_cast<std::int32_t>(state.flaw_count[i]) << 16);
    first += state.flaw_count[i];
  }
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

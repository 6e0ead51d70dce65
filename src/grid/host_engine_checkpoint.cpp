// The whole state of the engine out of its arrays and back into them. Both at a state boundary, just after a sorting:
// tiles, blocks and halo then follow from the particles' nodes and order alone, and no lane holds anything besides.
#include <algorithm>
#include <cstring>
#include <utility>

#include "breccia/error.hpp"
#include "grid/host_engine.hpp"
#include "grid/state_columns.hpp"
#include "mpi/together.hpp"

namespace breccia::grid {
namespace {

void require_slabs(const EngineState& state, int ranks) {
  const bool cut_for_all = !state.same_ranks || state.slab_cuts.size() + 1 == static_cast<std::size_t>(ranks);
  if (state.slab_axis < 0 || state.slab_axis > 2 || !cut_for_all || !std::ranges::is_sorted(state.slab_cuts)) {
    throw IoError("the checkpoint has slabs that are none");
  }
}

}  // namespace

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
    const auto growing = static_cast<std::uint32_t>(FlawState::of(f.state[lane]).active);
    const auto* bytes = reinterpret_cast<const std::byte*>(&growing);
    active.values.insert(active.values.end(), bytes, bytes + sizeof growing);
  }
  state.columns.push_back(std::move(active));
}

template <class P>
material::FlawLists HostEngine<P>::flaws() const {
  material::FlawLists lists;
  lists.first.push_back(0);
  for_each_particle([&](std::size_t slot, BlockCoord) {
    if (store_.has(Group::kFlaws)) {
      for (const material::FlawCode code : flaws_of(slot)) lists.threshold.push_back(material::threshold_of(code));
    }
    lists.first.push_back(static_cast<std::uint32_t>(lists.threshold.size()));
  });
  return lists;
}

template <class P>
void HostEngine<P>::restore(const EngineState& state, const material::FlawLists& flaws) {
  if (state.damage_finished && setup_.effects.damage) switch_damage_off();
  std::vector<Placement> placements;
  mpi::together<IoError>(comm_, [&] {
    require_slabs(state, comm_.size());
    placements = restore_places(state);
    for (const FieldDescriptor& field : fields<P>()) {
      if (store_.has(field.group) && saved_as_it_is(field)) restore_field(field, state);
    }
    if (store_.has(Group::kFlaws)) restore_flaws(state, flaws);
  });
  smallest_mass_ = state.smallest_mass;
  const mpi::Slabs saved(state.slab_axis, state.slab_cuts);
  const bool wanted = setup_.slab_axis.value_or(state.slab_axis) == state.slab_axis;
  if (state.same_ranks && wanted && saved.keep_whole(planes_kept_together(state.slab_axis))) {
    slabs_ = saved;
  } else {
    choose_slabs(placements);
  }
  settle(placements);
}

template <class P>
std::vector<Placement> HostEngine<P>::restore_places(const EngineState& state) {
  store_.allocate((state.particles + kLanes - 1) / kLanes);
  std::vector<Placement> placements(state.particles);
  for (std::size_t i = 0; i < placements.size(); ++i) {
    placements[i].slot = static_cast<std::uint32_t>(i);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int32_t node = state.node[3 * i + axis];
      const std::int32_t block = node >> 2;
      if (block > kBlockLimit || block < -kBlockLimit || periodicity_.wrap(block, static_cast<int>(axis)) != block) {
        throw IoError("the checkpoint has a particle outside the grid");
      }
      placements[i].node[axis] = node;
    }
  }
  return placements;
}

template <class P>
void HostEngine<P>::restore_field(const FieldDescriptor& field, const EngineState& state) {
  const auto element = static_cast<std::size_t>(field.element_bytes);
  const auto components = static_cast<std::size_t>(field.components);
  const std::byte* from = find_column(state, field.name, element, components).values.data();
  std::byte* const packs = store_.data(field.group) + field.offset;
  const std::size_t stride = ParticleStore<P>::stride(field.group);
  for (std::size_t i = 0; i < state.particles; ++i) {
    std::byte* to = packs + i / kLanes * stride + i % kLanes * element;
    for (std::size_t c = 0; c < components; ++c, from += element) std::memcpy(to + c * kLanes * element, from, element);
  }
}

template <class P>
void HostEngine<P>::restore_flaws(const EngineState& state, const material::FlawLists& flaws) {
  const std::byte* active = find_column(state, kActiveFlaws, 4, 1).values.data();
  take_flaws(flaws);
  for (std::size_t i = 0; i < state.particles; ++i) {
    std::uint32_t growing = 0;
    std::memcpy(&growing, active + i * sizeof growing, sizeof growing);
    set_flaws(i, flaws, i, growing);
  }
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

// Particles into the engine and the whole state out of it, in the form that no device determines.
#include <algorithm>
#include <cstring>

#include "breccia/error.hpp"
#include "cuda/cuda_engine.hpp"
#include "cuda/device_load.hpp"
#include "grid/state_columns.hpp"

namespace breccia::cuda {
namespace {

std::vector<std::int32_t> integers(const EngineState& state, const char* field) {
  const StateColumn& column = grid::find_column(state, field, sizeof(std::int32_t), 1);
  std::vector<std::int32_t> values(state.particles);
  if (!values.empty()) std::memcpy(values.data(), column.values.data(), column.values.size());
  return values;
}

}  // namespace

template <class P>
void CudaEngine<P>::insert(const ParticleArrays& particles, const material::FlawLists& flaws,
                           std::span<const Vec3d> spin_of_body) {
  // The host engine knows how positions become nodes and offsets; once, at the start.
  const auto host = grid::make_host_engine(setup_, comm_);
  host->insert(particles, flaws, spin_of_body);
  restore(host->save(), host->flaws());
}

template <class P>
EngineState CudaEngine<P>::save() const {
  EngineState state;
  state.particles = particles_.count();
  const auto keys = grid_.block_keys_of_particles(stream_);
  const auto packed = particles_.template download_component<std::int32_t>("node", 0, stream_);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      state.node.push_back(grid::kBlockWidth * grid::component(grid::block_coord(keys[i]), axis) +
                           (packed[i] >> (8 * axis) & 255) - grid::kNodeBias);
    }
  }
  for (const auto& field : particles_.fields()) {
    if (!grid::saved_as_it_is(*field.descriptor)) continue;
    StateColumn column = grid::column_for(*field.descriptor, 0);
    column.values = particles_.download(field, stream_);
    state.columns.push_back(std::move(column));
  }
  if (particles_.groups().flaws) save_flaws(state);
  state.damage_finished = setup_.effects.fully_damaged;
  state.smallest_mass = smallest_mass_;
  state.slab_axis = slabs_.axis();
  state.slab_cuts = slabs_.cuts();
  return state;
}

template <class P>
void CudaEngine<P>::save_flaws(EngineState& state) const {
  const auto count = particles_.template download_component<std::int32_t>("flaw_count", 0, stream_);
  StateColumn active{grid::kActiveFlaws, "", "flaws that grow", 4, 1, {}};
  for (std::size_t i = 0; i < count.size(); ++i) {
    const auto growing = static_cast<std::uint32_t>(count[i] & 0xffff);
    const auto* bytes = reinterpret_cast<const std::byte*>(&growing);
    active.values.insert(active.values.end(), bytes, bytes + sizeof growing);
  }
  state.columns.push_back(std::move(active));
}

template <class P>
material::FlawLists CudaEngine<P>::flaws() const {
  material::FlawLists lists;
  lists.first.assign(1, 0U);
  if (!particles_.groups().flaws) {
    lists.first.resize(particles_.count() + std::size_t{1}, 0U);
    return lists;
  }
  const auto first = particles_.template download_component<std::int32_t>("flaw_first", 0, stream_);
  const auto count = particles_.template download_component<std::int32_t>("flaw_count", 0, stream_);
  for (std::size_t i = 0; i < first.size(); ++i) {
    const auto own = flaw_thresholds_host_.begin() + first[i];
    lists.threshold.insert(lists.threshold.end(), own, own + (count[i] >> 16));
    lists.first.push_back(static_cast<std::uint32_t>(lists.threshold.size()));
  }
  return lists;
}

template <class P>
void CudaEngine<P>::restore(const EngineState& state, const material::FlawLists& flaws) {
  const mpi::Slabs saved(state.slab_axis, state.slab_cuts);
  const bool wanted = setup_.slab_axis.value_or(state.slab_axis) == state.slab_axis;
  if (!state.same_ranks || !wanted || !saved.keep_whole(mpi::kPlanesOfBlock)) {
    // The host engine knows how to cut slabs and share out particles.
    const auto host = grid::make_host_engine(setup_, comm_);
    host->restore(state, flaws);
    restore(host->save(), host->flaws());
    return;
  }
  slabs_ = saved;
  if (state.damage_finished && setup_.effects.damage) switch_damage_off();
  const Load load =
      count_load(state, flaws.threshold.size(), boundaries_.periodicity(), grid_.lone_without_grid(), own_planes());
  require_memory(bytes_needed<P>(particles_.record_bytes(), load), "the particles and their grid", comm_);
  particles_.allocate(state.particles);
  std::vector<grid::BlockKey> keys(state.particles);
  std::vector<std::int32_t> packed(state.particles);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const std::int32_t* node = state.node.data() + 3 * i;
    keys[i] = grid::block_key({node[0] >> 2, node[1] >> 2, node[2] >> 2});
    for (int axis = 0; axis < 3; ++axis) packed[i] |= ((node[axis] & 3) + grid::kNodeBias) << (8 * axis);
  }
  grid_.set_block_keys(keys, stream_);
  particles_.upload(*particles_.find("node"), reinterpret_cast<const std::byte*>(packed.data()), stream_);
  for (const auto& field : particles_.fields()) {
    if (!grid::saved_as_it_is(*field.descriptor)) continue;
    const StateColumn& column =
        grid::find_column(state, field.descriptor->name, static_cast<std::size_t>(field.descriptor->element_bytes),
                          static_cast<std::size_t>(field.descriptor->components));
    particles_.upload(field, column.values.data(), stream_);
  }
  if (particles_.groups().flaws) restore_flaws(state, flaws);
  smallest_mass_ = state.smallest_mass;
  settle();
}

template <class P>
void CudaEngine<P>::restore_flaws(const EngineState& state, const material::FlawLists& flaws) {
  const std::vector<std::int32_t> active = integers(state, grid::kActiveFlaws);
  std::vector<std::int32_t> first(state.particles), count(state.particles);
  std::vector<Real> next(state.particles);
  for (std::size_t i = 0; i < first.size(); ++i) {
    const std::span<const float> own = flaws.of(i);
    const auto all = static_cast<std::int32_t>(std::min<std::size_t>(own.size(), grid::FlawState::kMostFlaws));
    if (active[i] < 0 || active[i] > all) throw IoError("more flaws grow than the particle has");
    first[i] = material::flaw_place(flaws.first[i]);
    count[i] = active[i] | all << 16;
    next[i] = active[i] < all ? static_cast<Real>(own[static_cast<std::size_t>(active[i])]) : Real(1e30);
  }
  const auto upload = [&](const char* field, const auto& values) {
    particles_.upload(*particles_.find(field), reinterpret_cast<const std::byte*>(values.data()), stream_);
  };
  upload("flaw_first", first);
  upload("flaw_count", count);
  upload("next_threshold", next);
  flaw_thresholds_host_ = flaws.threshold;
  own_flaws_ = flaws.threshold.size();
  flaw_thresholds_.reserve(flaw_thresholds_host_.size());
  flaw_thresholds_.upload(flaw_thresholds_host_, stream_);
}

template class CudaEngine<MixedPrecision>;
template class CudaEngine<DoublePrecision>;

}  // namespace breccia::cuda

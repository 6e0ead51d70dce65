// Particles on their way to another rank, at a sorting: records with their flaws.
#include "grid/host_engine.hpp"
#include "mpi/message.hpp"

namespace breccia::grid {

using mpi::get;
using mpi::put;

template <class P>
void HostEngine<P>::put_record(const Placement& p, std::vector<std::byte>& message) {
  const std::size_t bytes = store_.record_bytes();
  put(message, p.node, 3);
  message.resize(message.size() + bytes);
  store_.read_record(p.slot, message.data() + message.size() - bytes);
  if (store_.has(Group::kFlaws)) {
    const std::span<const material::FlawCode> own = flaws_of(p.slot);
    put(message, own.data(), own.size());
  }
  // Its lane is empty now.
  store_.kinematics[p.slot / kLanes].mass.set(static_cast<int>(p.slot % kLanes), Real(0));
}

template <class P>
void HostEngine<P>::take_records(const std::vector<std::vector<std::byte>>& messages, Occupancy& occupancy) {
  const std::size_t bytes = store_.record_bytes();
  for (const std::vector<std::byte>& message : messages) {
    const std::byte* from = message.data();
    const std::byte* const end = from + message.size();
    while (from != end) {
      // A pack at a time: slots are cheap until arrange() closes the gaps.
      const std::size_t first = store_.packs() * kLanes;
      store_.append_packs(1);
      for (std::size_t slot = first; slot < first + kLanes && from != end; ++slot) {
        std::int32_t node[3];
        get(from, node, 3);
        store_.write_record(slot, from);
        from += bytes;
        set_destination(occupancy.add(node), slot);
        if (!store_.has(Group::kFlaws)) continue;
        store_.flaws[slot / kLanes].first.set(static_cast<int>(slot % kLanes),
                                              material::flaw_place(flaw_codes_.size()));
        const auto count = static_cast<std::size_t>(
            FlawState::of(store_.flaws[slot / kLanes].state[static_cast<int>(slot % kLanes)]).all);
        flaw_codes_.resize(flaw_codes_.size() + count);
        get(from, flaw_codes_.data() + flaw_codes_.size() - count, count);
      }
    }
  }
}

template <class P>
void HostEngine<P>::compact_flaws() {
  if (comm_.size() == 1) return;  // none has gone
  std::size_t live = 0;
  for_each_particle([&](std::size_t slot, BlockCoord) { live += flaws_of(slot).size(); });
  if (flaw_codes_.size() <= 2 * live) return;
  std::vector<material::FlawCode> kept;
  kept.reserve(live);
  for_each_particle([&](std::size_t slot, BlockCoord) {
    const std::span<const material::FlawCode> own = flaws_of(slot);
    store_.flaws[slot / kLanes].first.set(static_cast<int>(slot % kLanes), static_cast<std::int32_t>(kept.size()));
    kept.insert(kept.end(), own.begin(), own.end());
  });
  flaw_codes_ = std::move(kept);
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

// Particles that leave the planes of this rank, with their flaws, at a sorting.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "cuda/cuda_engine.hpp"
#include "mpi/message.hpp"

namespace breccia::cuda {
namespace {

using mpi::get;
using mpi::put;

// Work of a step [ps], from what an H100 takes with 65 and with 376 particles a tile in mixed precision (docs/gpu.md).
constexpr std::size_t kWarp = 32;
constexpr std::uint64_t kWarpWork = 8400;
constexpr std::uint64_t kTileWork = 12600;

}  // namespace

template <class P>
void CudaEngine<P>::migrate() {
  if (comm_.size() == 1) return;
  unsigned too_far = 0;
  grid_.place(particles_, too_far, stream_);
  if (comm_.any(too_far != 0)) throw NumericsError(kTooFar);
  const std::vector<grid::BlockKey> keys = grid_.block_keys_of_particles(stream_);
  std::vector<std::vector<unsigned>> leaving(static_cast<std::size_t>(comm_.size()));
  std::vector<unsigned> staying;
  std::vector<grid::BlockKey> staying_keys;
  for (unsigned slot = 0; slot < keys.size(); ++slot) {
    const int rank = slabs_.owner(grid::kBlockWidth * grid::component(grid::block_coord(keys[slot]), slabs_.axis()));
    if (rank == comm_.rank()) {
      staying.push_back(slot);
      staying_keys.push_back(keys[slot]);
    } else {
      leaving[static_cast<std::size_t>(rank)].push_back(slot);
    }
  }
  if (!comm_.any(staying.size() != keys.size())) return;
  take(staying, std::move(staying_keys), comm_.alltoall(messages_of(leaving, keys)));
}

template <class P>
std::vector<std::vector<std::byte>> CudaEngine<P>::messages_of(const std::vector<std::vector<unsigned>>& leaving,
                                                               std::span<const grid::BlockKey> keys) {
  const std::size_t record = particles_.record_bytes();
  const std::size_t first_at = particles_.place_in_record("flaw_first");
  const std::size_t count_at = particles_.place_in_record("flaw_count");
  std::vector<std::vector<std::byte>> messages(leaving.size());
  for (std::size_t rank = 0; rank < leaving.size(); ++rank) {
    const std::vector<std::byte> records = particles_.extract(leaving[rank], stream_);
    for (std::size_t i = 0; i < leaving[rank].size(); ++i) {
      const std::byte* own = records.data() + i * record;
      put(messages[rank], &keys[leaving[rank][i]], 1);
      put(messages[rank], own, record);
      if (!particles_.groups().flaws) continue;
      std::int32_t first = 0;
      std::int32_t count = 0;
      std::memcpy(&first, own + first_at, sizeof first);
      std::memcpy(&count, own + count_at, sizeof count);
      const auto flaws = static_cast<std::size_t>(count >> 16);
      put(messages[rank], flaw_thresholds_host_.data() + first, flaws);
      own_flaws_ -= flaws;
    }
  }
  return messages;
}

template <class P>
void CudaEngine<P>::take(std::span<const unsigned> staying, std::vector<grid::BlockKey> keys,
                         const std::vector<std::vector<std::byte>>& messages) {
  const std::size_t record = particles_.record_bytes();
  const std::size_t first_at = particles_.place_in_record("flaw_first");
  const std::size_t count_at = particles_.place_in_record("flaw_count");
  std::vector<std::byte> arrivals;
  for (const std::vector<std::byte>& message : messages) {
    const std::byte* from = message.data();
    const std::byte* const end = from + message.size();
    while (from != end) {
      keys.emplace_back();
      get(from, &keys.back(), 1);
      arrivals.insert(arrivals.end(), from, from + record);
      from += record;
      if (!particles_.groups().flaws) continue;
      std::byte* own = arrivals.data() + arrivals.size() - record;
      const std::int32_t first = material::flaw_place(flaw_thresholds_host_.size());
      std::int32_t count = 0;
      std::memcpy(&count, own + count_at, sizeof count);
      std::memcpy(own + first_at, &first, sizeof first);
      const auto flaws = static_cast<std::size_t>(count >> 16);
      flaw_thresholds_host_.resize(flaw_thresholds_host_.size() + flaws);
      get(from, flaw_thresholds_host_.data() + flaw_thresholds_host_.size() - flaws, flaws);
      own_flaws_ += flaws;
    }
  }
  particles_.replace(staying, arrivals, stream_);
  grid_.set_block_keys(keys, stream_);
  if (particles_.groups().flaws) {
    if (flaw_thresholds_host_.size() > 2 * own_flaws_) drop_flaws_of_others();
    flaw_thresholds_.reserve(flaw_thresholds_host_.size());
    flaw_thresholds_.upload(flaw_thresholds_host_, stream_);
  }
}

// Those of particles that have gone stay until they are the half.
template <class P>
void CudaEngine<P>::drop_flaws_of_others() {
  material::FlawLists own = flaws();
  flaw_thresholds_host_ = std::move(own.threshold);
  particles_.upload(*particles_.find("flaw_first"), reinterpret_cast<const std::byte*>(own.first.data()), stream_);
}

template <class P>
mpi::PlaneWork CudaEngine<P>::work(std::span<const double> more) const {
  mpi::PlaneWork work;
  const std::vector<grid::BlockKey> keys = grid_.block_keys_of_particles(stream_);
  std::size_t run = 0;  // particles of the block so far: after a sorting they lie together
  for (std::size_t i = 0; i < keys.size(); ++i) {
    run = i > 0 && keys[i] == keys[i - 1] ? run + 1 : 0;
    std::uint64_t cost = run % kWarp == 0 ? kWarpWork : 0;
    if (run == 0) cost += kTileWork;
    if (!more.empty()) cost += static_cast<std::uint64_t>(std::llround(more[i]));
    work.nodes[grid::kBlockWidth * grid::component(grid::block_coord(keys[i]), slabs_.axis())] += cost;
  }
  return work;
}

template <class P>
void CudaEngine<P>::cut(const mpi::Slabs& slabs) {
  slabs_ = slabs;
  migrate();
  settle();
}

template class CudaEngine<MixedPrecision>;
template class CudaEngine<DoublePrecision>;

}  // namespace breccia::cuda

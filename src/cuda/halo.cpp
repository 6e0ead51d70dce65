#include "cuda/halo.hpp"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "cuda/launchers.hpp"

namespace breccia::cuda {
namespace {

template <class T>
void replace(DeviceArray<T>& array, const std::vector<T>& values, cudaStream_t stream) {
  array.reserve(values.size());
  array.upload(values, stream);
}

// Keys of the blocks that each rank may reach as well: particles reach no further than the plane next to their own.
std::vector<std::vector<grid::BlockKey>> offers(std::span<const grid::BlockKey> blocks,
                                                const grid::Periodicity& periodicity, const mpi::Slabs& slabs,
                                                const mpi::Comm& comm) {
  std::vector<std::vector<grid::BlockKey>> of_rank(static_cast<std::size_t>(comm.size()));
  for (const grid::BlockKey key : blocks) {
    const std::int32_t plane = grid::component(grid::block_coord(key), slabs.axis());
    for (int side = -1; side <= 1; ++side) {
      const int rank = slabs.owner(grid::kBlockWidth * periodicity.wrap(plane + side, slabs.axis()));
      auto& keys = of_rank[static_cast<std::size_t>(rank)];
      if (rank != comm.rank() && (keys.empty() || keys.back() != key)) keys.push_back(key);
    }
  }
  return of_rank;
}

}  // namespace

template <class Real>
Halo<Real>::Halo(DeviceMessages wanted, const mpi::Comm& comm)
    : messages_(make_halo_messages(choose_messages(wanted, comm), kBlockValues * sizeof(Real), comm)) {}

template <class Real>
void Halo<Real>::set(std::span<const grid::BlockKey> blocks, unsigned tiles, const grid::Periodicity& periodicity,
                     const mpi::Slabs& slabs, const mpi::Comm& comm, cudaStream_t stream) {
  std::unordered_map<grid::BlockKey, unsigned> index;
  for (unsigned b = 0; b < blocks.size(); ++b) index[blocks[b]] = b;
  auto offered = comm.alltoall(offers(blocks, periodicity, slabs, comm));
  peers_.clear();
  shared_ = 0;
  std::vector<unsigned> sent;
  for (std::size_t rank = 0; rank < offered.size(); ++rank) {
    std::sort(offered[rank].begin(), offered[rank].end());
    Peer peer{static_cast<int>(rank), {}};
    for (const grid::BlockKey key : offered[rank]) {
      const auto found = index.find(key);
      if (found != index.end()) peer.blocks.push_back(found->second);
    }
    if (peer.blocks.empty()) continue;
    shared_ += peer.blocks.size();
    sent.insert(sent.end(), peer.blocks.begin(), peer.blocks.end());
    peers_.push_back(std::move(peer));
  }
  replace(sent_blocks_, sent, stream);
  part_tiles(blocks, tiles, periodicity, stream);
  list_contributions(blocks.size(), comm.rank(), stream);
  sent_.reserve(shared_ * kBlockValues);
  received_.reserve(shared_ * kBlockValues);
  std::vector<HaloPart> parts;
  for (const Peer& peer : peers_) parts.push_back({peer.rank, peer.blocks.size()});
  messages_->set(std::move(parts), sent_.data(), received_.data());
}

template <class Real>
void Halo<Real>::list_contributions(std::size_t blocks, int own_rank, cudaStream_t stream) {
  std::vector<unsigned> list_of_block(blocks, grid::kNoBlock);
  std::vector<std::vector<unsigned>> places;
  std::vector<unsigned> lower;
  unsigned place = 0;
  for (const Peer& peer : peers_) {
    for (const unsigned block : peer.blocks) {
      unsigned& list = list_of_block[block];
      if (list == grid::kNoBlock) {
        list = static_cast<unsigned>(places.size());
        places.emplace_back();
        lower.push_back(0);
      }
      places[list].push_back(place++);
      if (peer.rank < own_rank) ++lower[list];
    }
  }
  std::vector<unsigned> first{0};
  std::vector<unsigned> all;
  for (const auto& of_list : places) {
    all.insert(all.end(), of_list.begin(), of_list.end());
    first.push_back(static_cast<unsigned>(all.size()));
  }
  replace(list_of_block_, list_of_block, stream);
  replace(first_, first, stream);
  replace(lower_, lower, stream);
  replace(places_, all, stream);
}

template <class Real>
void Halo<Real>::part_tiles(std::span<const grid::BlockKey> blocks, unsigned tiles,
                            const grid::Periodicity& periodicity, cudaStream_t stream) {
  std::unordered_set<grid::BlockKey> shared;
  for (const Peer& peer : peers_) {
    for (const unsigned block : peer.blocks) shared.insert(blocks[block]);
  }
  const auto reaches_shared = [&](grid::BlockKey key) {
    const grid::BlockCoord own = grid::block_coord(key);
    for (int n = 0; n < 27; ++n) {
      const grid::BlockCoord other{own.x + n / 9 - 1, own.y + n / 3 % 3 - 1, own.z + n % 3 - 1};
      if (shared.contains(grid::block_key(periodicity.wrap(other)))) return true;
    }
    return false;
  };
  std::vector<unsigned> boundary;
  std::vector<unsigned> interior;
  for (unsigned t = 0; t < tiles; ++t) (reaches_shared(blocks[t]) ? boundary : interior).push_back(t);
  replace(boundary_, boundary, stream);
  replace(interior_, interior, stream);
  boundary_count_ = static_cast<unsigned>(boundary.size());
  interior_count_ = static_cast<unsigned>(interior.size());
}

template <class Real>
void Halo<Real>::send(const GridView<Real>& grid, cudaStream_t stream) {
  // The boundary of this step came after the nodes of the last one: nobody reads what that step received any more.
  scattered_.record(stream);
  scattered_.precede(stream_);
  launch_collect_shared(grid, sent_blocks_.data(), static_cast<unsigned>(shared_), sent_.data(), stream_);
  messages_->start(stream_);
}

template <class Real>
void Halo<Real>::receive(cudaStream_t stream) {
  if (!active()) return;
  messages_->finish(stream_);
  arrived_.record(stream_);
  arrived_.precede(stream);
}

template <class Real>
SharedView<Real> Halo<Real>::view() const {
  if (shared_ == 0) return {};
  return {list_of_block_.data(), first_.data(), lower_.data(), places_.data(), received_.data()};
}

template class Halo<float>;
template class Halo<double>;

}  // namespace breccia::cuda

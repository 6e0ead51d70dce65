// Sums of blocks that the particles of several ranks reach. Every such rank sends what it holds to every other one, and
// all of them add in the order of ranks: they find the same velocities, and nothing has to come back. The sums travel
// on a stream of their own while the tiles that no other rank waits for are at work.
#pragma once

#include <memory>
#include <vector>

#include "cuda/device_array.hpp"
#include "cuda/halo_messages.hpp"
#include "cuda/step_arguments.hpp"
#include "cuda/stream.hpp"
#include "mpi/comm.hpp"
#include "mpi/slabs.hpp"

namespace breccia::cuda {

template <class Real>
class Halo {
 public:
  /// By the way that `wanted` comes to (choose_messages). Collective. Throws UsageError if it cannot be.
  Halo(DeviceMessages wanted, const mpi::Comm& comm);
  /// `blocks`: keys of this rank's blocks, in their order, the first `tiles` of them with a tile. Collective.
  void set(std::span<const grid::BlockKey> blocks, unsigned tiles, const grid::Periodicity& periodicity,
           const mpi::Slabs& slabs, const mpi::Comm& comm, cudaStream_t stream);
  /// True if any block is shared.
  [[nodiscard]] bool active() const { return shared_ > 0; }
  /// Tiles that reach shared blocks, and all others.
  [[nodiscard]] TileList boundary() const { return {boundary_.data(), boundary_count_}; }
  [[nodiscard]] TileList interior() const { return {interior_.data(), interior_count_}; }
  /// Once `stream` has done what it has, the boundary's scatter, sums start on their way.
  void send(const GridView<Real>& grid, cudaStream_t stream);
  /// Ends what send() began: what `stream` does next finds the sums of other ranks. Collective; the host does not wait,
  /// or with MPI only where it cannot be ahead.
  void receive(cudaStream_t stream);
  /// HaloMessages::bring_in.
  void bring_in() { messages_->bring_in(); }
  /// Engine::abandon.
  void abandon() { messages_.reset(); }
  /// To be called before the host waits for `stream`. Throws IoError if messages are known to be lost.
  void watch(cudaStream_t stream) const {
    messages_->bring_in();
    messages_->watch(stream);
  }
  [[nodiscard]] SharedView<Real> view() const;
  /// Sent in one step.
  [[nodiscard]] std::size_t bytes() const { return shared_ * kBlockValues * sizeof(Real); }

 private:
  static constexpr std::size_t kBlockValues = std::size_t{kSums} * grid::kBlockNodes;
  struct Peer {
    int rank;
    std::vector<unsigned> blocks;  // in the order of their keys, which is the same on both sides
  };
  void part_tiles(std::span<const grid::BlockKey> blocks, unsigned tiles, const grid::Periodicity& periodicity,
                  cudaStream_t stream);
  void list_contributions(std::size_t blocks, int own_rank, cudaStream_t stream);

  std::vector<Peer> peers_;
  std::size_t shared_ = 0;  // blocks of all peers
  DeviceArray<unsigned> sent_blocks_, list_of_block_, first_, lower_, places_;
  DeviceArray<Real> sent_, received_;
  DeviceArray<unsigned> boundary_, interior_;
  unsigned boundary_count_ = 0, interior_count_ = 0;
  Stream stream_{Stream::Priority::kHigh};  // or its kernels would come behind the interior
  Event scattered_, arrived_;
  std::unique_ptr<HaloMessages> messages_;  // last: it ends before the memory that it sends from
};

extern template class Halo<float>;
extern template class Halo<double>;

}  // namespace breccia::cuda

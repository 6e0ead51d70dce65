// Sums of blocks that the particles of several ranks reach. Every such rank sends what it holds to every other one, and
// all of them add in the order of ranks: they find the same velocities, and nothing has to come back.
#pragma once

#include <vector>

#include "cuda/device_array.hpp"
#include "cuda/step_arguments.hpp"
#include "mpi/comm.hpp"
#include "mpi/slabs.hpp"

namespace breccia::cuda {

template <class Real>
class Halo {
 public:
  /// `blocks`: keys of this rank's blocks, in their order. Collective.
  void set(std::span<const grid::BlockKey> blocks, const grid::Periodicity& periodicity, const mpi::Slabs& slabs,
           const mpi::Comm& comm, cudaStream_t stream);
  /// After a scatter, before the nodes are updated. By way of pinned memory: the host waits. Collective.
  void exchange(const GridView<Real>& grid, const mpi::Comm& comm, cudaStream_t stream);
  [[nodiscard]] SharedView<Real> view() const;
  /// Sent in one step.
  [[nodiscard]] std::size_t bytes() const { return shared_ * kBlockValues * sizeof(Real); }

 private:
  static constexpr std::size_t kBlockValues = std::size_t{kSums} * grid::kBlockNodes;
  struct Peer {
    int rank;
    std::vector<unsigned> blocks;  // in the order of their keys, which is the same on both sides
  };
  void list_contributions(std::size_t blocks, int own_rank, cudaStream_t stream);

  std::vector<Peer> peers_;
  std::size_t shared_ = 0;  // blocks of all peers
  DeviceArray<unsigned> sent_blocks_, list_of_block_, first_, lower_, places_;
  DeviceArray<Real> sent_, received_;
  PinnedArray<Real> sent_host_, received_host_;
};

extern template class Halo<float>;
extern template class Halo<double>;

}  // namespace breccia::cuda

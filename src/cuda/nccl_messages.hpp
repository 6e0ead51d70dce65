// Sums of shared blocks by NCCL: sends and receives in the order of the halo's stream, from device to device. The host
// only enqueues them.
#pragma once

#include "cuda/halo_messages.hpp"
#include "cuda/nccl_library.hpp"

namespace breccia::cuda {

/// The ranks of a run as NCCL knows them, made from MPI.
class NcclCommunicator {
 public:
  /// Collective. Throws IoError.
  NcclCommunicator(const nccl::Library& library, const mpi::Comm& comm);
  /// Collective, but while an exception passes: then other ranks may not come, and what waits for them on this device
  /// ends.
  ~NcclCommunicator();
  NcclCommunicator(const NcclCommunicator&) = delete;
  NcclCommunicator& operator=(const NcclCommunicator&) = delete;

  /// Each part of `from` goes to its rank, and what comes from there to the same place of `to`, in the order of the
  /// stream. Hosts of ranks that meet for the first time wait for each other; no others do.
  void exchange(const std::vector<HaloPart>& parts, std::size_t block_bytes, const void* from, void* to,
                cudaStream_t stream) const;
  /// Throws IoError if something has gone wrong since: then nothing of this device waits for messages any more, and
  /// none can be sent.
  void look_for_errors();

 private:
  nccl::Library library_;
  nccl::Handle handle_ = nullptr;
  int exceptions_;  // that were passing when this was made
};

class NcclMessages final : public HaloMessages {
 public:
  /// Sends a first message to each neighbour and back, so that what cannot be is told before the run.
  NcclMessages(const nccl::Library& library, std::size_t block_bytes, const mpi::Comm& comm);

  /// Throws NumericsError on all ranks if two do not agree on what they share: their messages would not meet.
  void set(std::vector<HaloPart> parts, const void* sent, void* received) override;
  void start(cudaStream_t stream) override;
  void finish(cudaStream_t /*stream*/) override {}  // in the order of the stream already
  void watch(cudaStream_t stream) override;

 private:
  void greet_neighbours();

  std::size_t block_bytes_;
  mpi::Comm comm_;
  NcclCommunicator communicator_;
  std::vector<HaloPart> parts_;
  const void* sent_ = nullptr;
  void* received_ = nullptr;
};

}  // namespace breccia::cuda

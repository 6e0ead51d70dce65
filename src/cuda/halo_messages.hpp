// How sums of shared blocks get from rank to rank. They lie packed on the device, block after block and rank after
// rank, and go by MPI or by NCCL (docs/gpu.md says when which).
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "breccia/scene.hpp"
#include "cuda/device_runtime.hpp"
#include "mpi/comm.hpp"

namespace breccia::cuda {

/// What one other rank gets in a step; it sends as much back.
struct HaloPart {
  int rank;
  std::size_t blocks;
};

class HaloMessages {
 public:
  virtual ~HaloMessages() = default;
  /// The parts from now on, in their order in both buffers on the device. No message may be under way. Collective.
  virtual void set(std::vector<HaloPart> parts, const void* sent, void* received) = 0;
  /// `stream` has been told to fill the buffer that is sent: so filled it goes on its way. The host does not wait.
  virtual void start(cudaStream_t stream) = 0;
  /// What the same stream does from now on finds what the other ranks sent. With MPI the host waits, unless it is
  /// ahead.
  virtual void finish(cudaStream_t stream) = 0;
  /// To be called after the last of some steps, before the host waits for the device: what is still to be exchanged
  /// is. Collective.
  virtual void bring_in() {}
  /// Where the host is going to wait for all that `stream` has to do: ends with IoError instead of waiting for ever if
  /// a message that it waits for is lost, as far as that is told.
  virtual void watch(cudaStream_t /*stream*/) {}
};

enum class MessageWay { kPinnedMpi, kDeviceMpi, kNccl };

struct MessageChoice {
  MessageWay way;
  std::string description;  ///< for the user, with the reason where there was a choice; empty on one rank
  bool ahead = false;       ///< with MPI: the host enqueues steps whose messages have not arrived
};

/// The way that `wanted` comes to here, the same on all ranks. Collective. Throws UsageError on all ranks where kNccl
/// cannot be: without the library on a rank, or with ranks that share a device.
MessageChoice choose_messages(DeviceMessages wanted, const mpi::Comm& comm);

/// Messages of blocks of `block_bytes` each, in the way chosen. Collective.
std::unique_ptr<HaloMessages> make_halo_messages(const MessageChoice& choice, std::size_t block_bytes,
                                                 const mpi::Comm& comm);

}  // namespace breccia::cuda

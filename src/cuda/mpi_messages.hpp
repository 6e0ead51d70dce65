// Sums of shared blocks by MPI, by way of pinned memory of the host unless MPI reads that of the device. MPI knows
// nothing of streams. So what comes behind the messages is enqueued at once and waits on the device for a signal, which
// the host gives when they have arrived: it exchanges them when it comes to that, while it enqueues the next steps and
// at last before it waits for the device itself. Where streams cannot wait for the host, the host waits in each step.
#pragma once

#include <array>
#include <memory>

#include "cuda/device_array.hpp"
#include "cuda/halo_messages.hpp"
#include "cuda/stream.hpp"
#include "cuda/stream_signal.hpp"

namespace breccia::cuda {

class MpiMessages final : public HaloMessages {
 public:
  /// `direct`: from the device's memory. `ahead`: what comes behind the messages is enqueued before they arrive.
  MpiMessages(bool direct, bool ahead, std::size_t block_bytes, const mpi::Comm& comm);
  /// Collective, but while an exception passes: then other ranks may not come, and the device goes on without messages.
  ~MpiMessages() override;
  MpiMessages(const MpiMessages&) = delete;
  MpiMessages& operator=(const MpiMessages&) = delete;

  void set(std::vector<HaloPart> parts, const void* sent, void* received) override;
  void start(cudaStream_t stream) override;
  void finish(cudaStream_t stream) override;
  void bring_in() override;

 private:
  // Steps whose messages have not arrived: more than a window usually has. A step enqueues seven pieces of work on the
  // halo's stream, which takes about a thousand; beyond these the host would wait for a device that waits for the host.
  // Where it waits for the oldest messages instead, they come: of all ranks that do, the one at the earliest step waits
  // for others that have sent theirs already, or do so before they go on.
  static constexpr std::uint32_t kMostAhead = 48;
  static constexpr std::uint32_t kEvents = 64;  // so many that numbers of steps may begin again

  [[nodiscard]] std::size_t bytes() const;
  Event& packed(std::uint32_t step) { return packed_[step % kEvents]; }
  void exchange();               // what has been packed for the next step that has not arrived
  void arrived();                // all of it has
  void deliver();                // the same; the host waits
  void deliver_what_is_there();  // without waiting
  void give_up();                // what is under way

  bool direct_;
  std::size_t block_bytes_;
  mpi::Comm comm_;
  int exceptions_;                          // that were passing when this was made
  MPI_Datatype block_ = MPI_DATATYPE_NULL;  // so that counts are small
  std::vector<HaloPart> parts_;
  const void* sent_ = nullptr;
  void* received_ = nullptr;
  bool new_to_mpi_ = false;  // memory of a device, of this rank or of another
  PinnedArray<std::byte> sent_host_, received_host_;
  std::array<Event, kEvents> packed_;          // of the last steps
  std::vector<MPI_Request> receives_, sends_;  // of the step whose messages are under way
  std::uint32_t enqueued_ = 0;                 // steps so far
  std::uint32_t arrived_ = 0;
  std::unique_ptr<StreamSignal> signal_;  // set to arrived_; null: never ahead. Last: its end ends what waits for it
};

}  // namespace breccia::cuda

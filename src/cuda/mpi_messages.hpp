// Sums of shared blocks by MPI, by way of pinned memory of the host unless MPI reads that of the device. The host waits
// once a step: MPI knows nothing of streams.
#pragma once

#include "cuda/device_array.hpp"
#include "cuda/halo_messages.hpp"
#include "cuda/stream.hpp"

namespace breccia::cuda {

class MpiMessages final : public HaloMessages {
 public:
  /// `direct`: from the device's memory.
  MpiMessages(bool direct, std::size_t block_bytes, const mpi::Comm& comm);
  ~MpiMessages() override;
  MpiMessages(const MpiMessages&) = delete;
  MpiMessages& operator=(const MpiMessages&) = delete;

  void set(std::vector<HaloPart> parts, const void* sent, void* received) override;
  void start(cudaStream_t stream) override;
  void finish(cudaStream_t stream) override;

 private:
  [[nodiscard]] std::size_t bytes() const;

  bool direct_;
  std::size_t block_bytes_;
  mpi::Comm comm_;
  MPI_Datatype block_ = MPI_DATATYPE_NULL;  // so that counts are small
  std::vector<HaloPart> parts_;
  const void* sent_ = nullptr;
  void* received_ = nullptr;
  PinnedArray<std::byte> sent_host_, received_host_;
  Event ready_;
};

}  // namespace breccia::cuda

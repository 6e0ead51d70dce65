#include "cuda/device_mpi.hpp"

#include <mpi.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <string_view>
#if __has_include(<mpi-ext.h>)
#include <mpi-ext.h>
#endif

#include "cuda/check.hpp"
#include "cuda/device_array.hpp"
#include "cuda/stream.hpp"
#include "cuda/stream_signal.hpp"
#include "mpi/patience.hpp"

namespace breccia::cuda {
namespace {

// To the next rank from the one before.
class RingMessage {
 public:
  RingMessage(const DeviceArray<std::byte>& sent, DeviceArray<std::byte>& received, int bytes, const mpi::Comm& comm) {
    constexpr int kTag = 3;
    const int rank = comm.rank(), ranks = comm.size();
    MPI_Irecv(received.data(), bytes, MPI_BYTE, (rank + ranks - 1) % ranks, kTag, comm.handle(), &requests_[0]);
    MPI_Isend(sent.data(), bytes, MPI_BYTE, (rank + 1) % ranks, kTag, comm.handle(), &requests_[1]);
  }
  [[nodiscard]] bool comes_soon() { return mpi::complete_within(std::chrono::seconds(1), requests_); }
  void wait() { MPI_Waitall(2, requests_.data(), MPI_STATUSES_IGNORE); }

 private:
  std::array<MPI_Request, 2> requests_{MPI_REQUEST_NULL, MPI_REQUEST_NULL};
};

}  // namespace

bool mpi_takes_device_memory() {
  const char* wanted = std::getenv("BRECCIA_CUDA_AWARE_MPI");
  if (wanted != nullptr) return std::string_view(wanted) == "1";
#if defined(MPIX_CUDA_AWARE_SUPPORT)
  return MPIX_Query_cuda_support() == 1;
#else
  return false;
#endif
}

bool device_sees_messages() {
  int device = 0;
  check(cudaGetDevice(&device), "device");
  int ordering = 0;
  check(cudaDeviceGetAttribute(&ordering, cudaDevAttrGPUDirectRDMAWritesOrdering, device), "order of remote writes");
  return ordering >= cudaGPUDirectRDMAWritesOrderingOwner;
}

bool mpi_goes_on_beside_a_wait(const mpi::Comm& comm) {
  constexpr int kSmall = 1 << 8, kLarge = 1 << 22;
  const Stream stream(Stream::Priority::kHigh);  // as of a halo
  DeviceArray<std::byte> sent(kLarge), received(kLarge);
  sent.fill_bytes(0, stream);
  received.fill_bytes(0, stream);
  check(cudaStreamSynchronize(stream), "trial of messages");
  bool all_came = true;
  for (const int bytes : {kSmall, kLarge}) {
    RingMessage(sent, received, bytes, comm).wait();  // MPI knows the memory by then
    std::optional<StreamSignal> signal(std::in_place);
    signal->precede(stream, 1);
    RingMessage message(sent, received, bytes, comm);
    all_came = message.comes_soon() && all_came;
    signal.reset();  // what was behind it goes on
    message.wait();
  }
  return !comm.any(!all_came);
}

}  // namespace breccia::cuda

#include "cuda/stream_signal.hpp"

#include <atomic>

#include "breccia/error.hpp"
#include "cuda/stream.hpp"

namespace breccia::cuda {
namespace {

// cuStreamWaitValue32 of the driver, which programs must not be linked to: without one they take the host.
using WaitValue = int (*)(cudaStream_t stream, unsigned long long address, std::uint32_t value, unsigned flags);
constexpr unsigned kAtLeast = 0;  // CU_STREAM_WAIT_VALUE_GEQ

WaitValue find_wait_value() {
  constexpr unsigned kVersion = 12000;  // from which on every device has it
  void* function = nullptr;
  cudaDriverEntryPointQueryResult found{};
  const cudaError_t status =
      cudaGetDriverEntryPointByVersion("cuStreamWaitValue32", &function, kVersion, cudaEnableDefault, &found);
  if (status != cudaSuccess) (void)cudaGetLastError();
  const bool is_there = status == cudaSuccess && found == cudaDriverEntryPointSuccess;
  return is_there ? reinterpret_cast<WaitValue>(function) : nullptr;
}

bool enqueue_wait(WaitValue wait, cudaStream_t stream, const std::uint32_t* number, std::uint32_t value) {
  return wait != nullptr && wait(stream, reinterpret_cast<unsigned long long>(number), value, kAtLeast) == 0;
}

}  // namespace

bool StreamSignal::works() {
  const StreamSignal signal;
  const Stream stream;
  if (!enqueue_wait(signal.wait_, stream, signal.number_.data(), 0)) return false;
  check(cudaStreamSynchronize(stream), "signal of the host");
  return true;
}

StreamSignal::StreamSignal() : wait_(find_wait_value()) {
  number_.reserve(1);
  *number_.data() = 0;
}

void StreamSignal::precede(cudaStream_t stream, std::uint32_t number) const {
  if (!enqueue_wait(wait_, stream, number_.data(), number)) {
    throw NumericsError("CUDA: the driver does not let a stream wait for the host");
  }
}

void StreamSignal::set(std::uint32_t number) {
  std::atomic_ref(*number_.data()).store(number, std::memory_order_seq_cst);
}

}  // namespace breccia::cuda

#include "cuda/stream_signal.hpp"

#include <atomic>
#include <chrono>

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

bool ends_soon(cudaStream_t stream) {
  constexpr std::chrono::seconds kPatience{1};
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (cudaStreamQuery(stream) == cudaErrorNotReady) {
    if (std::chrono::steady_clock::now() > until) return false;
  }
  return true;
}

}  // namespace

bool StreamSignal::works() {
  const Stream held(Stream::Priority::kHigh), other;  // as of a halo and of an engine
  DeviceArray<int> number(1);
  number.fill_bytes(0, other);
  check(cudaStreamSynchronize(other), "trial of streams");
  StreamSignal signal;
  if (!signal.try_precede(held, 1)) return false;
  number.fill_bytes(0, other);
  const bool others_go_on = ends_soon(other);
  const bool waits = cudaStreamQuery(held) == cudaErrorNotReady;
  return waits && others_go_on;
}

StreamSignal::StreamSignal() : wait_(find_wait_value()) {
  number_.reserve(1);
  *number_.data() = 0;
}

StreamSignal::~StreamSignal() {
  set(last_);
  (void)cudaDeviceSynchronize();
}

bool StreamSignal::try_precede(cudaStream_t stream, std::uint32_t number) {
  if (wait_ == nullptr) return false;
  if (wait_(stream, reinterpret_cast<unsigned long long>(number_.data()), number, kAtLeast) != 0) return false;
  last_ = number;
  return true;
}

void StreamSignal::precede(cudaStream_t stream, std::uint32_t number) {
  if (!try_precede(stream, number)) throw NumericsError("CUDA: the driver does not let a stream wait for the host");
}

void StreamSignal::set(std::uint32_t number) {
  std::atomic_ref(*number_.data()).store(number, std::memory_order_seq_cst);
}

}  // namespace breccia::cuda

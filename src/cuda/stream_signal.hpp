// A number that streams wait for and the host sets: so work can be enqueued that must not begin before something has
// happened on the host.
#pragma once

#include <cstdint>

#include "cuda/device_array.hpp"

namespace breccia::cuda {

/// As long as a stream waits, nothing may be done that waits for the whole device, as the runtime may when memory is
/// made or freed, a stream made or a kernel loaded, which by default is when it is launched for the first time; nor
/// what makes the host wait, like a copy from or to memory that is not pinned.
class StreamSignal {
 public:
  /// Whether driver and device can, which is tried: a stream waits, another one goes on meanwhile.
  static bool works();

  StreamSignal();
  /// Gives all signals, and waits for the device, which may still look at the number.
  ~StreamSignal();
  StreamSignal(const StreamSignal&) = delete;
  StreamSignal& operator=(const StreamSignal&) = delete;

  /// Whether the driver has such a wait, and lets `stream` wait for this number from now on.
  [[nodiscard]] bool try_precede(cudaStream_t stream, std::uint32_t number);
  /// What is enqueued on `stream` from now on comes after set() of this number, or of a later one. Throws NumericsError
  /// where works() is false.
  void precede(cudaStream_t stream, std::uint32_t number);
  /// Numbers go up; beyond the largest they begin again. What the host wrote before is seen behind it.
  void set(std::uint32_t number);

 private:
  int (*wait_)(cudaStream_t, unsigned long long, std::uint32_t, unsigned);  // null: the driver has none
  std::uint32_t last_ = 0;                                                  // that a stream waits for
  PinnedArray<std::uint32_t> number_;
};

}  // namespace breccia::cuda

// A number that streams wait for and the host sets: so work can be enqueued that must not begin before something has
// happened on the host.
#pragma once

#include <cstdint>

#include "cuda/device_array.hpp"

namespace breccia::cuda {

/// As long as a stream waits, nothing may be done that waits for the whole device, as the runtime may when memory is
/// made or freed, a stream made or a kernel loaded, which by default is when it is launched for the first time.
class StreamSignal {
 public:
  /// Whether the driver and this device can.
  static bool works();

  StreamSignal();
  /// What is enqueued on `stream` from now on comes after set() of this number, or of a later one. Throws NumericsError
  /// where works() is false.
  void precede(cudaStream_t stream, std::uint32_t number) const;
  /// Numbers go up; beyond the largest they begin again. What the host wrote before is seen behind it.
  void set(std::uint32_t number);

 private:
  int (*wait_)(cudaStream_t, unsigned long long, std::uint32_t, unsigned);  // null: the driver has none
  PinnedArray<std::uint32_t> number_;
};

}  // namespace breccia::cuda

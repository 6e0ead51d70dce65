// Device, memory and kernels of the emulated runtime; streams are in stream_api.cpp.
#include "tests/cuda/emulation/runtime_api.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <map>
#include <set>
#include <vector>

#include "tests/cuda/emulation/cuda_emulation.hpp"
#include "tests/cuda/emulation/stream_api.hpp"

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/asan_interface.h>
#endif

namespace breccia::cuda_emulation {

namespace {

// What the environment says of the device, or what one like an H100 has.
std::size_t property(const char* variable, std::size_t usual) {
  const char* wanted = std::getenv(variable);
  return wanted == nullptr ? usual : std::strtoull(wanted, nullptr, 10);
}
std::size_t device_bytes() { return property("BRECCIA_EMULATED_MEMORY", std::size_t{2} << 30); }
// For a thread block.
int shared_memory_bytes() { return static_cast<int>(property("BRECCIA_EMULATED_SHARED", 232448)); }
// What arrives from other devices is seen in order (as cudaGPUDirectRDMAWritesOrdering).
int remote_writes_ordering() { return static_cast<int>(property("BRECCIA_EMULATED_WRITES_ORDERING", 100)); }
// 90 is 9.0.
int capability() { return static_cast<int>(property("BRECCIA_EMULATED_CAPABILITY", 90)); }
#if defined(__SANITIZE_ADDRESS__)
constexpr std::size_t kGuard = 0;  // the sanitizer sees every access beyond the end
void forbid(const unsigned char* start, std::size_t bytes) { __asan_poison_memory_region(start, bytes); }
void permit(const unsigned char* start, std::size_t bytes) { __asan_unpoison_memory_region(start, bytes); }
#else
constexpr std::size_t kGuard = 256;
void forbid(const unsigned char*, std::size_t) {}
void permit(const unsigned char*, std::size_t) {}
#endif
constexpr unsigned char kFill = 0xff;

struct Allocation {
  std::size_t bytes;
  std::size_t used;         // the first of them
  bool restricted = false;  // use_only() has said so
};
struct Memory {
  std::map<const unsigned char*, Allocation> allocations;
  std::size_t used = 0;
  std::size_t most = 0;          // used at any time
  std::uint64_t generation = 1;  // changes with the allocations

  [[nodiscard]] std::span<const unsigned char> around(const void* address) const {
    const auto* a = static_cast<const unsigned char*>(address);
    auto next = allocations.upper_bound(a);
    if (next == allocations.begin()) return {};
    --next;
    if (a >= next->first + next->second.used) return {};
    return {next->first, next->second.used};
  }
  // Whether all of [address, address + bytes) lies in what is used of one allocation.
  [[nodiscard]] bool holds(const void* address, std::size_t bytes) const {
    const std::span<const unsigned char> found = around(address);
    return !found.empty() && static_cast<const unsigned char*>(address) + bytes <= found.data() + found.size();
  }
};
Memory& memory() {
  static Memory the_memory;
  return the_memory;
}

std::set<const void*> loaded;  // kernels
const Substitutes* substitutes = nullptr;
std::uint64_t allocation_calls = 0;
std::uint64_t copied_to_host = 0;

int device_of_this = 0;
std::map<const unsigned char*, std::size_t> pinned;  // bytes
bool is_pinned(const void* address) {
  const auto* a = static_cast<const unsigned char*>(address);
  const auto next = pinned.upper_bound(a);
  return next != pinned.begin() && a < std::prev(next)->first + std::prev(next)->second;
}
}  // namespace

std::uint64_t allocation_count() { return allocation_calls; }
std::uint64_t bytes_to_host() { return copied_to_host; }
std::size_t most_bytes() { return memory().most; }
void forget_most_bytes() { memory().most = memory().used; }
std::size_t used_bytes() { return memory().used; }
std::size_t live_allocations() { return memory().allocations.size(); }

void use_only(const void* address, std::size_t bytes) {
  const auto* start = static_cast<const unsigned char*>(address);
  Allocation& a = memory().allocations.at(start);
  if (a.restricted && bytes <= a.used) return;
  permit(start, bytes);
  forbid(start + bytes, a.bytes - bytes);
  a.used = bytes;
  a.restricted = true;
  ++memory().generation;
}

std::span<const unsigned char> allocation_of(const void* address) { return memory().around(address); }
std::uint64_t allocation_generation() { return memory().generation; }

void substitute_kernels(const Substitutes* by_name) { substitutes = by_name; }

const Substitute* substitute_for(const std::string& kernel, const std::vector<std::size_t>& parameter_bytes) {
  if (substitutes == nullptr) return nullptr;
  const auto found = substitutes->find(kernel);
  if (found == substitutes->end()) throw EmulationError(kernel + " has no translation");
  if (found->second.parameter_bytes != parameter_bytes)
    throw EmulationError(kernel + ": its parameters have other sizes where it was translated");
  ++found->second.launches;
  return &found->second;
}

}  // namespace breccia::cuda_emulation

using breccia::cuda_emulation::EmulationError;
using breccia::cuda_emulation::memory;

const char* cudaGetErrorString(cudaError_t error) {
  switch (error) {
    case cudaSuccess:
      return "no error";
    case cudaErrorInvalidValue:
      return "invalid argument";
    case cudaErrorMemoryAllocation:
      return "out of memory";
    case cudaErrorInsufficientDriver:
      return "CUDA driver version is insufficient for CUDA runtime version";
    case cudaErrorNoDevice:
      return "no CUDA-capable device is detected";
    case cudaErrorNoKernelImageForDevice:
      return "no kernel image is available for execution on the device";
    case cudaErrorNotReady:
      return "device not ready";
  }
  return "unknown error";
}
cudaError_t cudaGetLastError() { return cudaSuccess; }
cudaError_t cudaGetDeviceCount(int* count) {
  const char* wanted = std::getenv("BRECCIA_EMULATED_DEVICES");
  *count = wanted == nullptr ? 1 : std::atoi(wanted);
  return *count > 0 ? cudaSuccess : cudaErrorNoDevice;
}
cudaError_t cudaSetDevice(int device) {
  breccia::cuda_emulation::device_of_this = device;
  return cudaSuccess;
}
cudaError_t cudaGetDevice(int* device) {
  *device = breccia::cuda_emulation::device_of_this;
  return cudaSuccess;
}
cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int device) {
  using namespace breccia::cuda_emulation;
  *properties = {"emulated device", device_bytes(), capability() / 10, capability() % 10, 0, device, 0};
  return cudaSuccess;
}
cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr attribute, int) {
  using namespace breccia::cuda_emulation;
  *value = attribute == cudaDevAttrGPUDirectRDMAWritesOrdering ? remote_writes_ordering() : shared_memory_bytes();
  return cudaSuccess;
}
cudaError_t emulatedFuncLoad(const void* kernel) {
  using namespace breccia::cuda_emulation;
  if (loaded.insert(kernel).second) refuse_where_host_is_awaited("a kernel is loaded");
  return cudaSuccess;
}
// The kernels are there for 8.0 and what comes.
cudaError_t emulatedFuncSetAttribute(cudaFuncAttribute, int value) {
  using namespace breccia::cuda_emulation;
  if (capability() < 80) return cudaErrorNoKernelImageForDevice;
  return value <= shared_memory_bytes() ? cudaSuccess : cudaErrorInvalidValue;
}
cudaError_t cudaMemGetInfo(std::size_t* available, std::size_t* total) {
  *total = breccia::cuda_emulation::device_bytes();
  *available = *total - memory().used;
  return cudaSuccess;
}

cudaError_t cudaMalloc(void** address, std::size_t bytes) {
  using namespace breccia::cuda_emulation;
  ++allocation_calls;
  refuse_where_host_is_awaited("memory is made");
  if (memory().used + bytes > device_bytes()) return cudaErrorMemoryAllocation;
  auto* start = static_cast<unsigned char*>(std::malloc(bytes + 2 * kGuard));
  if (start == nullptr) return cudaErrorMemoryAllocation;
  std::memset(start, kFill, bytes + 2 * kGuard);
  memory().allocations[start + kGuard] = {.bytes = bytes, .used = bytes};
  ++memory().generation;
  memory().used += bytes;
  memory().most = std::max(memory().most, memory().used);
  *address = start + kGuard;
  return cudaSuccess;
}

cudaError_t cudaFree(void* address) {
  using namespace breccia::cuda_emulation;
  if (address == nullptr) return cudaSuccess;
  ++allocation_calls;
  run_all();  // as the runtime waits
  const auto found = memory().allocations.find(static_cast<unsigned char*>(address));
  if (found == memory().allocations.end()) return cudaErrorInvalidValue;
  auto* start = static_cast<unsigned char*>(address);
  const std::size_t bytes = found->second.bytes, used = found->second.used;
  permit(start, bytes);
  bool intact = true;
  for (std::size_t n = 1; n <= kGuard; ++n) intact = intact && *(start - n) == kFill;
  for (std::size_t n = used; n < bytes + kGuard; ++n) intact = intact && start[n] == kFill;
  memory().used -= bytes;
  memory().allocations.erase(found);
  ++memory().generation;
  std::free(start - kGuard);
  if (!intact) throw EmulationError("a kernel wrote outside of an allocation of " + std::to_string(used) + " bytes");
  return cudaSuccess;
}

cudaError_t cudaMallocHost(void** address, std::size_t bytes) {
  ++breccia::cuda_emulation::allocation_calls;
  breccia::cuda_emulation::refuse_where_host_is_awaited("pinned memory is made");
  *address = std::malloc(bytes);
  breccia::cuda_emulation::pinned[static_cast<unsigned char*>(*address)] = bytes;
  return *address != nullptr ? cudaSuccess : cudaErrorMemoryAllocation;
}
cudaError_t cudaFreeHost(void* address) {
  ++breccia::cuda_emulation::allocation_calls;
  breccia::cuda_emulation::run_all();
  breccia::cuda_emulation::pinned.erase(static_cast<unsigned char*>(address));
  std::free(address);
  return cudaSuccess;
}

cudaError_t cudaMemcpyAsync(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind, cudaStream_t stream) {
  if (bytes == 0) return cudaSuccess;
  const bool to_device = kind != cudaMemcpyDeviceToHost;
  const bool from_device = kind != cudaMemcpyHostToDevice;
  if (memory().holds(to, bytes) != to_device || memory().holds(from, bytes) != from_device)
    return cudaErrorInvalidValue;
  using namespace breccia::cuda_emulation;
  const void* host = to_device ? from : to;
  if (kind != cudaMemcpyDeviceToDevice && !is_pinned(host)) refuse_where_host_is_awaited("unpinned memory is copied");
  if (kind == cudaMemcpyDeviceToHost) breccia::cuda_emulation::copied_to_host += bytes;
  stream->enqueue([=] { std::memcpy(to, from, bytes); });
  return cudaSuccess;
}
cudaError_t cudaMemcpy2DAsync(void* to, std::size_t to_pitch, const void* from, std::size_t from_pitch,
                              std::size_t width, std::size_t height, cudaMemcpyKind kind, cudaStream_t stream) {
  if (width > to_pitch || width > from_pitch) return cudaErrorInvalidValue;
  for (std::size_t row = 0; row < height; ++row) {
    const cudaError_t status = cudaMemcpyAsync(static_cast<char*>(to) + row * to_pitch,
                                               static_cast<const char*>(from) + row * from_pitch, width, kind, stream);
    if (status != cudaSuccess) return status;
  }
  return cudaSuccess;
}
cudaError_t cudaMemsetAsync(void* to, int value, std::size_t bytes, cudaStream_t stream) {
  if (bytes == 0) return cudaSuccess;
  if (!memory().holds(to, bytes)) return cudaErrorInvalidValue;
  stream->enqueue([=] { std::memset(to, value, bytes); });
  return cudaSuccess;
}

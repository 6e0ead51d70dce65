// CUDA on the CPU, for tests: the part of the language and of the runtime that our kernels use, as plain C++. The same
// .cu file is compiled by nvcc for a device and by g++ against this header. One block runs at a time, every thread of
// it as a fiber; the order of lanes and blocks is chosen by the test. Mistakes that a device would pass over are
// errors: threads that wait at different barriers or leave before one, shuffles with lanes that never come, writes
// outside of shared or global memory; memory starts as NaN. Built with the address or thread sanitizer it checks every
// access.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <typeinfo>
#include <vector>

#include "tests/cuda/emulation/runtime_api.hpp"

namespace breccia::cuda_emulation {

/// A kernel did what no kernel may do. Says which kernel, block, thread and source line.
class EmulationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// In which order lanes of a block, and blocks, run between two barriers. Random: one warp at a time runs ahead of the
/// others, lanes and blocks are shuffled, streams go on before anybody waits for them.
enum class Order { kForward, kReverse, kRandom };
void set_order(Order order, std::uint64_t seed = 1);

/// Launches so far; the test of the number of launches per step counts them.
std::uint64_t launch_count();
/// Calls that made the host wait for the device.
std::uint64_t synchronisation_count();
/// Whether a stream waits for the host, or will.
bool host_is_awaited();
/// Calls that made or freed memory of a device, or pinned memory of the host: each may wait for the device.
std::uint64_t allocation_count();
/// Copied from device to host so far.
std::uint64_t bytes_to_host();
/// Most device memory in use at a time since it was last forgotten [bytes].
std::size_t most_bytes();
void forget_most_bytes();
/// Device memory in use [bytes].
std::size_t used_bytes();
/// Allocations of device memory that are not freed.
std::size_t live_allocations();
/// Of this allocation the first `bytes` are in use from now on: an access beyond is one beyond its end. Once more only
/// what has been out of use can come into it: work that is late may still need the rest.
void use_only(const void* memory, std::size_t bytes);

/// What runs in place of a kernel: takes its parameters one behind the other, laid out as in a struct.
struct Substitute {
  std::vector<std::size_t> parameter_bytes;
  void (*run)(const std::byte* parameters);
  mutable std::uint64_t launches = 0;
};
using Substitutes = std::map<std::string, Substitute>;
/// From now on these run in place of the kernels of their names; a launch of another one is an error. Null: the kernels
/// themselves. The table must outlive its use.
void substitute_kernels(const Substitutes* by_name);

/// tile_pass<float> of what the compiler calls a type that names the kernel.
std::string kernel_name(const char* mangled);

void launch(const std::string& kernel, dim3 grid, dim3 block, std::size_t shared_bytes, cudaStream_t stream,
            std::function<void()> body);
/// The substitute of a kernel, or null. Throws EmulationError if the sizes of its parameters are others.
const Substitute* substitute_for(const std::string& kernel, const std::vector<std::size_t>& parameter_bytes);

template <class T>
void append_parameter(std::vector<std::byte>& parameters, const T& value) {
  parameters.resize((parameters.size() + alignof(T) - 1) / alignof(T) * alignof(T) + sizeof(T));
  std::memcpy(parameters.data() + parameters.size() - sizeof(T), &value, sizeof(T));
}

template <auto kKernel>
struct KernelTag {};

/// Arguments are copied at the launch, as for a device.
template <auto kKernel, class... Parameters>
void launch_kernel(void (*kernel)(Parameters...), dim3 grid, dim3 block, std::size_t shared_bytes, cudaStream_t stream,
                   std::type_identity_t<Parameters>... arguments) {
  (void)emulatedFuncLoad(reinterpret_cast<const void*>(kernel));
  const std::string name = kernel_name(typeid(KernelTag<kKernel>).name());
  if (const Substitute* substitute = substitute_for(name, {sizeof(Parameters)...})) {
    std::vector<std::byte> parameters;
    (append_parameter(parameters, arguments), ...);
    launch(name, grid, block, shared_bytes, stream, [run = substitute->run, parameters] { run(parameters.data()); });
  } else {
    launch(name, grid, block, shared_bytes, stream, [=] { kernel(arguments...); });
  }
}

// What runs inside a kernel.
dim3 thread_index();
dim3 block_index();
dim3 block_size();
dim3 grid_size();
void* shared_memory();
std::size_t shared_bytes();
/// Ends the launch with an EmulationError that says where.
[[noreturn]] void stop_kernel(const std::string& what);
/// The allocation that holds an address, or nothing; valid while the generation stays the same.
std::span<const unsigned char> allocation_of(const void* address);
std::uint64_t allocation_generation();
void synchronise_block(int line);
unsigned reduce_block(unsigned value, int line);  // sum over the block, at a barrier

enum class Collective { kSync, kShuffle, kBallot, kOr };
/// Waits for the lanes of `mask`. `value` is what this lane gives, `source` the lane it reads (shuffle).
std::uint64_t warp_collective(Collective kind, unsigned mask, std::uint64_t value, unsigned source, int line);

template <class T>
T shuffle(unsigned mask, T value, unsigned source, int line) {
  static_assert(sizeof(T) <= 8);
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof(T));
  bits = warp_collective(Collective::kShuffle, mask, bits, source, line);
  std::memcpy(&value, &bits, sizeof(T));
  return value;
}
unsigned lane_of_warp();

}  // namespace breccia::cuda_emulation

#define BRECCIA_LAUNCH(kernel, grid, block, shared_bytes, stream, ...) \
  breccia::cuda_emulation::launch_kernel<&kernel>(&kernel, grid, block, shared_bytes, stream, __VA_ARGS__)
// NOLINTNEXTLINE(bugprone-macro-parentheses): a type
#define BRECCIA_SHARED(Type, name) Type& name = *static_cast<Type*>(breccia::cuda_emulation::shared_memory())

// The names are CUDA's.
// NOLINTBEGIN(bugprone-reserved-identifier, readability-identifier-naming)
#define __global__
#define __device__
#define __host__
#define __forceinline__ inline
#define __restrict__ __restrict
#define __launch_bounds__(...)
#define threadIdx (breccia::cuda_emulation::thread_index())
#define blockIdx (breccia::cuda_emulation::block_index())
#define blockDim (breccia::cuda_emulation::block_size())
#define gridDim (breccia::cuda_emulation::grid_size())

inline void __syncthreads(int line = __builtin_LINE()) { breccia::cuda_emulation::synchronise_block(line); }
inline int __syncthreads_count(int predicate, int line = __builtin_LINE()) {
  return static_cast<int>(breccia::cuda_emulation::reduce_block(predicate != 0 ? 1U : 0U, line));
}
inline void __syncwarp(unsigned mask = 0xffffffffU, int line = __builtin_LINE()) {
  breccia::cuda_emulation::warp_collective(breccia::cuda_emulation::Collective::kSync, mask, 0, 0, line);
}
inline unsigned __ballot_sync(unsigned mask, int predicate, int line = __builtin_LINE()) {
  return static_cast<unsigned>(breccia::cuda_emulation::warp_collective(breccia::cuda_emulation::Collective::kBallot,
                                                                        mask, predicate != 0 ? 1U : 0U, 0, line));
}
inline unsigned __reduce_or_sync(unsigned mask, unsigned value, int line = __builtin_LINE()) {
  return static_cast<unsigned>(
      breccia::cuda_emulation::warp_collective(breccia::cuda_emulation::Collective::kOr, mask, value, 0, line));
}
template <class T>
T __shfl_sync(unsigned mask, T value, int source, int line = __builtin_LINE()) {
  return breccia::cuda_emulation::shuffle(mask, value, static_cast<unsigned>(source), line);
}
template <class T>
T __shfl_up_sync(unsigned mask, T value, unsigned delta, int line = __builtin_LINE()) {
  const unsigned lane = breccia::cuda_emulation::lane_of_warp();
  return breccia::cuda_emulation::shuffle(mask, value, lane >= delta ? lane - delta : lane, line);
}
template <class T>
T __shfl_down_sync(unsigned mask, T value, unsigned delta, int line = __builtin_LINE()) {
  const unsigned lane = breccia::cuda_emulation::lane_of_warp();
  return breccia::cuda_emulation::shuffle(mask, value, lane + delta < 32 ? lane + delta : lane, line);
}
inline float rsqrtf(float x) { return 1.0F / std::sqrt(x); }
inline double rsqrt(double x) { return 1.0 / std::sqrt(x); }
inline int __popc(unsigned x) { return __builtin_popcount(x); }
inline int __ffs(int x) { return __builtin_ffs(x); }
inline int __clz(int x) { return x == 0 ? 32 : __builtin_clz(static_cast<unsigned>(x)); }

template <class T>
T atomicAdd(T* address, T value) {
  return __atomic_fetch_add(address, value, __ATOMIC_RELAXED);
}
template <class T>
T atomicOr(T* address, T value) {
  return __atomic_fetch_or(address, value, __ATOMIC_RELAXED);
}
template <class T>
T atomicMax(T* address, T value) {
  T old = __atomic_load_n(address, __ATOMIC_RELAXED);
  while (old < value && !__atomic_compare_exchange_n(address, &old, value, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
  return old;
}
template <class T>
T atomicCAS(T* address, T expected, T value) {
  __atomic_compare_exchange_n(address, &expected, value, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
  return expected;
}
// NOLINTEND(bugprone-reserved-identifier, readability-identifier-naming)

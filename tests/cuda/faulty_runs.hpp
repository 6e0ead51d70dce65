// Runs a faulty kernel on the emulated device and tells what it says.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/cuda/faulty_kernels.hpp"

namespace breccia::cuda_test {

inline constexpr unsigned kBlocks = 5;
inline constexpr int kSum = static_cast<int>(kBlocks) * kThreads * (kThreads - 1) / 2;

/// The sum, in memory of so many bytes of which it uses 4. Throws EmulationError.
template <Fault kFault>
int run(cuda_emulation::Order order, std::size_t bytes = sizeof(int)) {
  using cuda_emulation::EmulationError;
  cuda_emulation::set_order(order, 7);
  cudaStream_t stream = nullptr;
  EXPECT_EQ(cudaStreamCreate(&stream), cudaSuccess);
  void* total = nullptr;
  EXPECT_EQ(cudaMalloc(&total, bytes), cudaSuccess);
  cuda_emulation::use_only(total, sizeof(int));
  EXPECT_EQ(cudaMemsetAsync(total, 0, sizeof(int), stream), cudaSuccess);
  int result = 0;
  std::string error;
  try {
    BRECCIA_LAUNCH(sum_of_blocks<kFault>, dim3(kBlocks), dim3(kThreads), sizeof(Values), stream,
                   static_cast<int*>(total));
    EXPECT_EQ(cudaMemcpyAsync(&result, total, sizeof(int), cudaMemcpyDeviceToHost, stream), cudaSuccess);
    EXPECT_EQ(cudaStreamSynchronize(stream), cudaSuccess);
  } catch (const EmulationError& e) {
    error = e.what();
  }
  try {
    EXPECT_EQ(cudaFree(total), cudaSuccess);
  } catch (const EmulationError& e) {
    error = e.what();
  }
  cudaStreamDestroy(stream);
  if (!error.empty()) throw EmulationError(error);
  return result;
}

/// What the emulation says; empty if nothing.
template <Fault kFault>
std::string error_of(cuda_emulation::Order order = cuda_emulation::Order::kRandom, std::size_t bytes = sizeof(int)) {
  try {
    run<kFault>(order, bytes);
  } catch (const cuda_emulation::EmulationError& error) {
    return error.what();
  }
  return "";
}

inline bool says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace breccia::cuda_test

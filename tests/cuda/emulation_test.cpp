// The emulation itself: a right kernel is right in any order; each kind of mistake is found.
#include <gtest/gtest.h>

#include "tests/cuda/faulty_runs.hpp"

namespace breccia::cuda_test {
namespace {

using cuda_emulation::Order;

TEST(Emulation, RightKernelGivesTheSameInAnyOrder) {
  for (const Order order : {Order::kForward, Order::kReverse, Order::kRandom})
    EXPECT_EQ(run<Fault::kNone>(order), kSum);
}

TEST(Emulation, MissingBarrierShowsAsUninitialisedMemory) { EXPECT_NE(run<Fault::kNoBarrier>(Order::kForward), kSum); }

TEST(Emulation, FindsThreadsAtDifferentBarriers) {
  EXPECT_TRUE(says(error_of<Fault::kDivergentBarrier>(), "waits at the barrier of line"));
}

TEST(Emulation, FindsAThreadThatLeavesBeforeABarrier) {
  const std::string error = error_of<Fault::kEarlyExit>();
  EXPECT_TRUE(says(error, "thread 5: left before the barrier of line")) << error;
}

TEST(Emulation, FindsAShuffleWithLanesThatNeverCome) {
  EXPECT_TRUE(says(error_of<Fault::kLostLane>(), "before the warp function")) << error_of<Fault::kLostLane>();
}

#if !defined(__SANITIZE_ADDRESS__)
// The address sanitizer ends the process at the access itself: the faulty program is run under it instead.
TEST(Emulation, FindsSharedMemoryOverrun) {
  EXPECT_TRUE(says(error_of<Fault::kOverrun>(), "beyond its shared memory"));
}
TEST(Emulation, FindsGlobalMemoryOverrun) {
  EXPECT_TRUE(says(error_of<Fault::kGlobalOverrun>(), "outside of an allocation"));
}
TEST(Emulation, FindsWritesToTheRoomOfAnArray) {
  EXPECT_TRUE(says(error_of<Fault::kGlobalOverrun>(Order::kRandom, 8), "outside of an allocation of 4 bytes"));
}
#endif

TEST(Emulation, CopiesAreCheckedAgainstAllocations) {
  cudaStream_t stream = nullptr;
  ASSERT_EQ(cudaStreamCreate(&stream), cudaSuccess);
  void* device = nullptr;
  int host[2] = {1, 2};
  ASSERT_EQ(cudaMalloc(&device, sizeof(int)), cudaSuccess);
  EXPECT_EQ(cudaMemcpyAsync(device, host, sizeof(int), cudaMemcpyHostToDevice, stream), cudaSuccess);
  EXPECT_EQ(cudaMemcpyAsync(device, host, sizeof host, cudaMemcpyHostToDevice, stream), cudaErrorInvalidValue);
  EXPECT_EQ(cudaMemcpyAsync(host, device, sizeof(int), cudaMemcpyHostToDevice, stream), cudaErrorInvalidValue);
  EXPECT_EQ(cudaFree(device), cudaSuccess);
  EXPECT_EQ(cudaFree(device), cudaErrorInvalidValue);
  cudaStreamDestroy(stream);
}

// What a wait or an event orders is done, what nothing orders is not.
TEST(Emulation, StreamsAreLate) {
  cuda_emulation::set_order(Order::kForward);
  cudaStream_t first = nullptr, second = nullptr;
  cudaEvent_t event = nullptr;
  void* memory = nullptr;
  ASSERT_EQ(cudaStreamCreate(&first), cudaSuccess);
  ASSERT_EQ(cudaStreamCreate(&second), cudaSuccess);
  ASSERT_EQ(cudaEventCreateWithFlags(&event, cudaEventDisableTiming), cudaSuccess);
  ASSERT_EQ(cudaMalloc(&memory, sizeof(int)), cudaSuccess);
  for (const bool ordered : {false, true}) {
    int result = 0;
    cudaMemsetAsync(memory, 0, sizeof(int), first);
    cudaStreamSynchronize(first);
    cudaMemsetAsync(memory, 1, sizeof(int), first);
    cudaEventRecord(event, first);
    if (ordered) cudaStreamWaitEvent(second, event, 0);
    cudaMemcpyAsync(&result, memory, sizeof(int), cudaMemcpyDeviceToHost, second);
    cudaStreamSynchronize(second);
    EXPECT_EQ(result, ordered ? 0x01010101 : 0);
    cudaEventSynchronize(event);
  }
  cudaFree(memory);
  cudaEventDestroy(event);
  cudaStreamDestroy(first);
  cudaStreamDestroy(second);
}

__global__ void nothing() {}  // that no other test launches

template <class Call>
std::string refusal(Call&& call) {
  try {
    call();
  } catch (const cuda_emulation::EmulationError& error) {
    return error.what();
  }
  return "";
}

// As long as a stream waits for the host nothing can be done for which the whole device is waited for.
TEST(Emulation, FindsHostAndDeviceThatWaitForEachOther) {
  cuda_emulation::set_order(Order::kForward);
  cudaStream_t stream = nullptr;
  void* total = nullptr;
  ASSERT_EQ(cudaStreamCreate(&stream), cudaSuccess);
  ASSERT_EQ(cudaMalloc(&total, sizeof(int)), cudaSuccess);
  void* pinned = nullptr;
  ASSERT_EQ(cudaMallocHost(&pinned, sizeof(int)), cudaSuccess);
  cudaMemsetAsync(total, 0, sizeof(int), stream);
  bool has_come = false;
  stream->hold([&] { return has_come; }, true);
  int result = -1;
  const auto copy_to = [&](void* to) { cudaMemcpyAsync(to, total, sizeof(int), cudaMemcpyDeviceToHost, stream); };
  copy_to(pinned);
  const auto launch = [&] { cuda_emulation::launch_kernel<&nothing>(&nothing, dim3(1), dim3(1), 0, stream); };
  EXPECT_EQ(refusal([&] { cudaStreamSynchronize(stream); }), "the host waits for a stream that waits for the host");
  EXPECT_EQ(refusal([&] { cudaFree(total); }), "the host waits for a stream that waits for the host");
  void* memory = nullptr;
  cudaStream_t other = nullptr;
  EXPECT_EQ(refusal([&] { cudaMalloc(&memory, 1); }), "memory is made while a stream waits for the host");
  EXPECT_EQ(refusal([&] { cudaMallocHost(&memory, 1); }), "pinned memory is made while a stream waits for the host");
  EXPECT_EQ(refusal([&] { cudaStreamCreate(&other); }), "a stream is made while a stream waits for the host");
  EXPECT_EQ(refusal(launch), "a kernel is loaded while a stream waits for the host");
  EXPECT_EQ(refusal([&] { copy_to(&result); }), "unpinned memory is copied while a stream waits for the host");
  has_come = true;
  EXPECT_EQ(refusal([&] { copy_to(&result); }), "");
  EXPECT_EQ(refusal([&] { cudaStreamSynchronize(stream); }), "");
  EXPECT_EQ(result, 0);
  EXPECT_EQ(cudaFreeHost(pinned), cudaSuccess);
  EXPECT_EQ(cudaFree(total), cudaSuccess);
  EXPECT_EQ(cudaStreamDestroy(stream), cudaSuccess);
}

TEST(Emulation, GraphRepeatsWhatTheStreamWouldDo) {
  cuda_emulation::set_order(Order::kForward);
  cudaStream_t stream = nullptr;
  ASSERT_EQ(cudaStreamCreate(&stream), cudaSuccess);
  void* total = nullptr;
  ASSERT_EQ(cudaMalloc(&total, sizeof(int)), cudaSuccess);
  cudaMemsetAsync(total, 0, sizeof(int), stream);
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t executable = nullptr;
  ASSERT_EQ(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), cudaSuccess);
  BRECCIA_LAUNCH(sum_of_blocks<Fault::kNone>, dim3(kBlocks), dim3(kThreads), sizeof(Values), stream,
                 static_cast<int*>(total));
  ASSERT_EQ(cudaStreamEndCapture(stream, &graph), cudaSuccess);
  ASSERT_EQ(cudaGraphInstantiate(&executable, graph, 0), cudaSuccess);
  ASSERT_EQ(cudaGraphDestroy(graph), cudaSuccess);
  int result = -1;
  cudaMemcpyAsync(&result, total, sizeof(int), cudaMemcpyDeviceToHost, stream);
  cudaStreamSynchronize(stream);
  EXPECT_EQ(result, 0);
  for (int n = 0; n < 3; ++n) EXPECT_EQ(cudaGraphLaunch(executable, stream), cudaSuccess);
  cudaMemcpyAsync(&result, total, sizeof(int), cudaMemcpyDeviceToHost, stream);
  cudaStreamSynchronize(stream);
  EXPECT_EQ(result, 3 * kSum);
  cudaGraphExecDestroy(executable);
  cudaFree(total);
  cudaStreamDestroy(stream);
}

}  // namespace
}  // namespace breccia::cuda_test

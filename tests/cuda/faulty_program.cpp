// Runs one faulty kernel and ends with 0 if nothing stopped it: built with a sanitizer, which must.
#include <cstdio>
#include <string>

#include "tests/cuda/faulty_kernels.hpp"

namespace breccia::cuda_test {
namespace {

template <Fault kFault>
void run(int* total, cudaStream_t stream) {
  BRECCIA_LAUNCH(sum_of_blocks<kFault>, dim3(5), dim3(kThreads), sizeof(Values), stream, total);
}

}  // namespace
}  // namespace breccia::cuda_test

int main(int count, char** arguments) {
  using namespace breccia::cuda_test;
  const std::string fault = count > 1 ? arguments[1] : "";
  cudaStream_t stream = nullptr;
  void* memory = nullptr;
  cudaStreamCreate(&stream);
  cudaMalloc(&memory, fault == "room_overrun" ? 4 * sizeof(int) : sizeof(int));
  breccia::cuda_emulation::use_only(memory, sizeof(int));
  cudaMemsetAsync(memory, 0, sizeof(int), stream);
  int* total = static_cast<int*>(memory);
  if (fault == "none") run<Fault::kNone>(total, stream);
  if (fault == "no_barrier") run<Fault::kNoBarrier>(total, stream);
  if (fault == "no_atomic") run<Fault::kNoAtomic>(total, stream);
  if (fault == "overrun") run<Fault::kOverrun>(total, stream);
  if (fault == "global_overrun" || fault == "room_overrun") run<Fault::kGlobalOverrun>(total, stream);
  if (fault == "overflow") run<Fault::kOverflow>(total, stream);
  int result = 0;
  cudaMemcpyAsync(&result, total, sizeof(int), cudaMemcpyDeviceToHost, stream);
  cudaStreamSynchronize(stream);
  cudaFree(memory);
  cudaStreamDestroy(stream);
  std::printf("went on to the end: %d\n", result);
  return 0;
}

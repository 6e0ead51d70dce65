#include "cuda/check.hpp"
#include "cuda/lone_pass.cuh"

namespace breccia::cuda {

template <class Real>
void prepare_lone_pass() {
  load(&lone_pass<Real>);
}

template <class Real>
void launch_lone_pass(const PassArguments<Real>& a, cudaStream_t stream) {
  if (a.lone == 0) return;
  BRECCIA_LAUNCH(lone_pass<Real>, dim3(blocks_for(a.lone, kPassThreads)), dim3(kPassThreads),
                 kPassThreads * sizeof(ThreadWork), stream, a);
  check(cudaGetLastError(), "launch of the lone pass");
}

template void prepare_lone_pass<float>();
template void prepare_lone_pass<double>();
template void launch_lone_pass<float>(const PassArguments<float>&, cudaStream_t);
template void launch_lone_pass<double>(const PassArguments<double>&, cudaStream_t);

}  // namespace breccia::cuda

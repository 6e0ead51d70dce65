// A file for each precision: they compile at the same time.
#include "cuda/tile_pass.cuh"

namespace breccia::cuda {

template std::string why_no_tile_pass<float>();
template void prepare_tile_pass<float>();
template void launch_tile_pass<float>(const PassArguments<float>&, cudaStream_t);

}  // namespace breccia::cuda

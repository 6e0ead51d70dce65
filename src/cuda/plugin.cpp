#include <string>

#include "breccia/error.hpp"
#include "cuda/cuda_engine.hpp"
#include "cuda/device_memory.hpp"
#include "cuda/device_plan.hpp"
#include "cuda/halo_messages.hpp"
#include "cuda/plugin_interface.hpp"

namespace breccia::cuda {
namespace {

const char* select_device(int local_rank, std::string& name) {
  int count = 0;
  const cudaError_t status = cudaGetDeviceCount(&count);
  if (status != cudaSuccess) {
    (void)cudaGetLastError();
    return cudaGetErrorString(status);
  }
  if (count == 0) return "no CUDA device";
  const int device = local_rank % count;
  cudaDeviceProp properties{};
  if (cudaSetDevice(device) != cudaSuccess || cudaGetDeviceProperties(&properties, device) != cudaSuccess) {
    return "the CUDA device cannot be used";
  }
  name = std::string(properties.name) + " (" + std::to_string(device + 1) + " of " + std::to_string(count) + ")";
  return nullptr;
}

std::string describe_messages(DeviceMessages wanted, const mpi::Comm& comm) {
  return choose_messages(wanted, comm).description;
}

grid::Engine* make_engine(const grid::EngineSetup& setup, const mpi::Comm& comm) {
  if (setup.numerics.precision == Precision::kDouble) return new CudaEngine<DoublePrecision>(setup, comm);
  return new CudaEngine<MixedPrecision>(setup, comm);
}

constexpr PluginInterface kInterface{BRECCIA_VERSION,    &select_device, &ranks_on_device,
                                     &describe_messages, &memory_of,     &make_engine};

}  // namespace
}  // namespace breccia::cuda

extern "C" __attribute__((visibility("default"))) const breccia::cuda::PluginInterface* breccia_cuda_plugin() {
  return &breccia::cuda::kInterface;
}

#include <string>

#include "breccia/error.hpp"
#include "cuda/cuda_engine.hpp"
#include "cuda/device_memory.hpp"
#include "cuda/device_plan.hpp"
#include "cuda/halo_messages.hpp"
#include "cuda/launchers.hpp"
#include "cuda/plugin_interface.hpp"

namespace breccia::cuda {
namespace {

// What the kernels are compiled for, and more (CMAKE_CUDA_ARCHITECTURES).
constexpr int kLeastMajor = 8;

// Why the engine cannot run on the current device.
std::string why_unfit(const cudaDeviceProp& device, Precision precision) {
  if (device.major < kLeastMajor) {
    return "it has compute capability " + std::to_string(device.major) + "." + std::to_string(device.minor) +
           ", and the engine needs " + std::to_string(kLeastMajor) + ".0";
  }
  const bool mixed = precision == Precision::kMixed;
  const std::string why_not = mixed ? why_no_tile_pass<float>() : why_no_tile_pass<double>();
  return why_not.empty() || mixed ? why_not : why_not + " in double precision";
}

const char* select_device(int local_rank, Precision precision, std::string& name) {
  int count = 0;
  cudaError_t status = cudaGetDeviceCount(&count);
  if (status == cudaSuccess && count == 0) status = cudaErrorNoDevice;
  const int device = count > 0 ? local_rank % count : 0;
  cudaDeviceProp properties{};
  if (status == cudaSuccess) status = cudaSetDevice(device);
  if (status == cudaSuccess) status = cudaGetDeviceProperties(&properties, device);
  if (status != cudaSuccess) {
    (void)cudaGetLastError();
    return cudaGetErrorString(status);
  }
  static std::string unfit;  // for the caller to read
  unfit = why_unfit(properties, precision);
  if (!unfit.empty()) {
    unfit = std::string(properties.name) + " cannot be used: " + unfit;
    return unfit.c_str();
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

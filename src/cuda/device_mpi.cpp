#include "cuda/device_mpi.hpp"

#include <mpi.h>

#include <cstdlib>
#include <string_view>
#if __has_include(<mpi-ext.h>)
#include <mpi-ext.h>
#endif

#include "cuda/check.hpp"

namespace breccia::cuda {

bool mpi_takes_device_memory() {
  const char* wanted = std::getenv("BRECCIA_CUDA_AWARE_MPI");
  if (wanted != nullptr) return std::string_view(wanted) == "1";
#if defined(MPIX_CUDA_AWARE_SUPPORT)
  return MPIX_Query_cuda_support() == 1;
#else
  return false;
#endif
}

bool device_sees_messages() {
  int device = 0;
  check(cudaGetDevice(&device), "device");
  int ordering = 0;
  check(cudaDeviceGetAttribute(&ordering, cudaDevAttrGPUDirectRDMAWritesOrdering, device), "order of remote writes");
  return ordering >= cudaGPUDirectRDMAWritesOrderingOwner;
}

}  // namespace breccia::cuda

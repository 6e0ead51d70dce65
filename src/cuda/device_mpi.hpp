// Whether MPI reads and writes the memory of a device.
#pragma once

namespace breccia::cuda {

/// What MPIX_Query_cuda_support says; BRECCIA_CUDA_AWARE_MPI (0 or 1) overrules it.
bool mpi_takes_device_memory();

}  // namespace breccia::cuda

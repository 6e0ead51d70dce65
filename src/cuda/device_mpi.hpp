// How MPI and the memory of a device go together.
#pragma once

namespace breccia::cuda {

/// What MPIX_Query_cuda_support says; BRECCIA_CUDA_AWARE_MPI (0 or 1) overrules it.
bool mpi_takes_device_memory();

/// Whether what MPI has put into this device's memory is seen by all that has not begun on it by then.
bool device_sees_messages();

}  // namespace breccia::cuda

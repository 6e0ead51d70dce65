// How MPI and the memory of a device go together.
#pragma once

#include "mpi/comm.hpp"

namespace breccia::cuda {

/// What MPIX_Query_cuda_support says; BRECCIA_CUDA_AWARE_MPI (0 or 1) overrules it.
bool mpi_takes_device_memory();

/// Whether this device sees what others, like network cards, write to its memory in the order in which they do: what
/// begins on it after a message has arrived finds the message.
bool device_sees_messages();

/// Whether MPI exchanges memory of devices while a stream of each waits for the host, which is tried with a small and a
/// large message: its own copies could be behind that stream in a queue of the device. The same on all ranks.
/// Collective.
bool mpi_goes_on_beside_a_wait(const mpi::Comm& comm);

}  // namespace breccia::cuda

// The end of MPI, which waits for all ranks, is bounded.
#pragma once

#include <chrono>

namespace breccia::mpi {

/// How long the end of Environment waits for the other ranks, which have nothing left to do when they come to it: 20 s
/// unless set here. A rank that still waits then (one was killed on the last steps, and the launcher did not end the
/// others) says so on standard error and ends its process with exit code 1. At least 1 s.
void set_patience_at_end(std::chrono::seconds patience);

}  // namespace breccia::mpi

// What one rank reads, all ranks get: the result or the error.
#pragma once

#include <functional>
#include <string>

#include "mpi/comm.hpp"

namespace breccia::scene {

/// Runs `read` on rank 0 of `comm` and returns its bytes on all ranks; an Error thrown there is thrown on all.
/// Without a communicator it just runs. Collective.
std::string from_root(const mpi::Comm* comm, const std::function<std::string()>& read);

}  // namespace breccia::scene

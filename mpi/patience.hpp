// Messages that are waited for, but not for ever.
#pragma once

#include <mpi.h>

#include <chrono>
#include <span>
#include <thread>

namespace breccia::mpi {

/// True once all `requests` are complete; false if that takes longer than `patience`: then they stay as they are.
inline bool complete_within(std::chrono::seconds patience, std::span<MPI_Request> requests) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  const auto all_are = [&] {
    int done = 0;
    MPI_Testall(static_cast<int>(requests.size()), requests.data(), &done, MPI_STATUSES_IGNORE);
    return done != 0;
  };
  while (!all_are()) {
    if (std::chrono::steady_clock::now() >= deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace breccia::mpi

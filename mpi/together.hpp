// A stage without collective calls that fails on one rank fails on all of them.
#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "mpi/comm.hpp"

namespace breccia::mpi {

/// Runs `stage` on every rank; if it threw an E on any, throws the E of the lowest of these on all. Collective.
template <class E, class Stage>
void together(const Comm& comm, Stage&& stage) {
  std::string error;
  try {
    std::forward<Stage>(stage)();
  } catch (const E& e) {
    error = std::string(e.what()) + '\n';
  }
  const std::vector<char> errors = comm.allgather_arrays(std::span<const char>(error));
  if (!errors.empty()) throw E(std::string(errors.begin(), std::find(errors.begin(), errors.end(), '\n')));
}

}  // namespace breccia::mpi

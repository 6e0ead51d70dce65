// What a result was made with: the processor and the versions of everything that computes or writes.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace breccia::io {

struct Machine {
  std::string cpu_model;        ///< as the operating system names it; "unknown" if it does not
  std::string instruction_set;  ///< of the kernels in use
  int cores = 0;                ///< hardware threads of this node
};

/// The machine of this rank.
Machine this_machine();

/// Name and version of breccia, the compiler, MPI and HDF5, in this order.
std::vector<std::pair<std::string, std::string>> library_versions();

}  // namespace breccia::io

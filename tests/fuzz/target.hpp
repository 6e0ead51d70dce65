// What every fuzz target needs: MPI once, and the errors that are the right answer to a wrong input.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "breccia/error.hpp"
#include "mpi/comm.hpp"

namespace breccia::fuzz {

/// MPI for as long as the fuzzer lives.
inline void start_mpi() { static const mpi::Environment environment(nullptr, nullptr); }

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Calls `body`, which may throw an Error with one of the codes a wrong input deserves. Anything else is a finding.
template <class Body>
void expect_user_errors(Body&& body) {
  try {
    body();
  } catch (const Error& error) {
    if (error.code() != ExitCode::kUsage && error.code() != ExitCode::kIo) std::abort();
  }
}

}  // namespace breccia::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

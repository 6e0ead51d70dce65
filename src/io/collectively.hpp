// Errors that all ranks see alike: a stage that fails on one rank throws the same error on every rank, so that no rank
// waits in a collective call the others never reach.
#pragma once

#include <exception>
#include <filesystem>
#include <optional>
#include <utility>

#include "breccia/error.hpp"
#include "mpi/comm.hpp"

namespace breccia::io {

/// Throws the error of the lowest rank that has one on every rank, with its type and message. Collective.
void throw_everywhere(const std::optional<Error>& error, const mpi::Comm& comm);

/// Runs `stage` on every rank, then throws on all if it threw on any. Collective.
template <class Stage>
void collectively(const mpi::Comm& comm, Stage&& stage) {
  std::optional<Error> error;
  try {
    std::forward<Stage>(stage)();
  } catch (const Error& e) {
    error = e;
  } catch (const std::filesystem::filesystem_error& e) {
    error = IoError(e.path1().string() + ": " + e.code().message());
  } catch (const std::exception& e) {
    error = IoError(e.what());
  }
  throw_everywhere(error, comm);
}

/// Runs `stage` on the root only; its error is thrown on every rank. Collective.
template <class Stage>
void on_root(const mpi::Comm& comm, Stage&& stage) {
  collectively(comm, [&] {
    if (comm.is_root()) std::forward<Stage>(stage)();
  });
}

}  // namespace breccia::io

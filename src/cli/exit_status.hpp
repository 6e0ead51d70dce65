// How a command ends: one line on standard error, one exit code on all ranks, and no rank left waiting.
#pragma once

#include <chrono>
#include <functional>

#include "mpi/comm.hpp"

namespace breccia::cli {

/// Runs `command` and returns the exit code of the process: 0, the code of a breccia::Error, or 1 for any other
/// exception (a defect of the program). All ranks return the code of the lowest rank that failed, which prints its
/// error as one line on standard error. If the other ranks do not end too within `patience`, the job is aborted with
/// that code: an error that all ranks share reaches them at about the same time, ranks that wait for this one in a
/// collective call never end by themselves. Collective.
int exit_status(const std::function<void()>& command, const mpi::Comm& comm,
                std::chrono::seconds patience = std::chrono::seconds(10));

}  // namespace breccia::cli

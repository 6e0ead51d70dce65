#include "cli/exit_status.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "breccia/error.hpp"
#include "mpi/patience.hpp"

namespace breccia::cli {
namespace {

constexpr int kDefect = 1;

struct Outcome {
  int code = static_cast<int>(ExitCode::kDone);
  std::string message;
};

Outcome outcome_of(const std::function<void()>& command) {
  try {
    command();
    return {};
  } catch (const Error& error) {
    return {static_cast<int>(error.code()), error.what()};
  } catch (const std::bad_alloc&) {
    return {kDefect, "out of memory"};
  } catch (const std::exception& error) {
    return {kDefect, std::string("internal error: ") + error.what()};
  }
}

void print_error(const Outcome& outcome, int rank) {
  // Errors quote what they were given: it must not break the line, nor do more to a terminal than be shown.
  std::string line = outcome.message;
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  const std::string where = rank == 0 ? "" : fmt::format("rank {}: ", rank);
  std::fflush(stdout);
  // To stop when told so is no error.
  const char* const kind = outcome.code == static_cast<int>(ExitCode::kStopped) ? "" : "error: ";
  fmt::print(stderr, "breccia: {}{}{}\n", kind, where, line);
}

}  // namespace

int exit_status(const std::function<void()>& command, const mpi::Comm& comm, std::chrono::seconds patience) {
  // An own communicator: the ranks may have left `comm` in the middle of different collective calls.
  MPI_Comm ending = MPI_COMM_NULL;
  MPI_Comm_dup(comm.handle(), &ending);
  const Outcome mine = outcome_of(command);

  std::vector<int> codes(static_cast<std::size_t>(comm.size()));
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallgather(&mine.code, 1, MPI_INT, codes.data(), 1, MPI_INT, ending, &request);
  if (mine.code == 0) {
    MPI_Wait(&request, MPI_STATUS_IGNORE);
  } else if (!mpi::complete_within(patience, {&request, 1})) {
    print_error(mine, comm.rank());
    MPI_Abort(comm.handle(), mine.code);
  }
  MPI_Comm_free(&ending);

  const auto failed = std::find_if(codes.begin(), codes.end(), [](int code) { return code != 0; });
  if (failed == codes.end()) return 0;
  if (failed - codes.begin() == comm.rank()) print_error(mine, comm.rank());
  return *failed;
}

}  // namespace breccia::cli

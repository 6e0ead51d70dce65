#include "sim/stop_requests.hpp"

#include <algorithm>
#include <array>
#include <csignal>

namespace breccia::sim {
namespace {

enum Reason : std::int32_t { kNone, kWalltime, kFile, kUser1, kTerminate, kInterrupt };
constexpr std::array kText{"",
                           "the wall time is nearly over",
                           "there was a file named stop",
                           "it got SIGUSR1",
                           "it got SIGTERM",
                           "it got SIGINT"};
constexpr std::array kSignals{SIGUSR1, SIGTERM, SIGINT};

// A handler may touch nothing else.
volatile std::sig_atomic_t last_signal = 0;
volatile std::sig_atomic_t interrupted = 0;

void take(int signal) {
  if (signal == SIGINT) {
    if (interrupted != 0) {
      std::signal(SIGINT, SIG_DFL);
      std::raise(SIGINT);
    }
    interrupted = 1;
  }
  last_signal = signal;
}

Reason signal_reason() {
  if (last_signal == SIGUSR1) return kUser1;
  if (last_signal == SIGTERM) return kTerminate;
  return last_signal == SIGINT ? kInterrupt : kNone;
}

bool take_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::remove(path, ignored);
}

}  // namespace

void keep_stop_signals() {
  struct sigaction action {};
  action.sa_handler = take;
  action.sa_flags = SA_RESTART;
  for (const int signal : kSignals) sigaction(signal, &action, nullptr);
}

StopRequests::StopRequests(const std::filesystem::path& folder, std::optional<double> walltime,
                           std::chrono::steady_clock::time_point start, const mpi::Comm& comm)
    : folder_(folder), walltime_(walltime), start_(start), comm_(comm) {}

Requests StopRequests::poll(double reserve) {
  std::array<std::int32_t, 2> mine{signal_reason(), 0};
  if (comm_.is_root()) {
    const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    if (walltime_ && elapsed + reserve >= *walltime_) mine[0] = std::max<std::int32_t>(mine[0], kWalltime);
    if (take_file(folder_ / "stop")) mine[0] = std::max<std::int32_t>(mine[0], kFile);
    mine[1] = take_file(folder_ / "output_now") ? 1 : 0;
  }
  MPI_Allreduce(MPI_IN_PLACE, mine.data(), 2, mpi::datatype<std::int32_t>(), MPI_MAX, comm_.handle());
  return {mine[0] == kNone ? nullptr : kText[static_cast<std::size_t>(mine[0])], mine[1] != 0};
}

}  // namespace breccia::sim

#include "bench/message_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "bench/json_output.hpp"
#include "breccia/error.hpp"
#include "mpi/comm.hpp"

namespace breccia::bench {
namespace {

// Seconds of an exchange of `bytes` both ways at once: best of batches, since other programs may hold a core.
double exchange_seconds(int peer, std::size_t bytes, int batches, int exchanges) {
  std::vector<std::byte> out(bytes), in(bytes);
  const auto count = static_cast<int>(bytes);
  double best = HUGE_VAL;
  for (int b = 0; b < batches; ++b) {
    const double start = MPI_Wtime();
    for (int n = 0; n < exchanges; ++n) {
      MPI_Sendrecv(out.data(), count, MPI_BYTE, peer, 0, in.data(), count, MPI_BYTE, peer, 0, MPI_COMM_WORLD,
                   MPI_STATUS_IGNORE);
    }
    best = std::min(best, (MPI_Wtime() - start) / exchanges);
  }
  return best;
}

}  // namespace

void run_message_bench(const MessageBenchOptions& options) {
  const mpi::Comm comm;
  if (comm.size() < 2) throw UsageError("messages need two ranks: mpirun -n 2 breccia_bench messages");
  const bool takes_part = comm.rank() == 0 || comm.rank() == comm.size() - 1;
  double latency = 0.0;
  double large = 0.0;
  constexpr std::size_t kLarge = 4'000'000;
  if (takes_part) {
    const int peer = comm.rank() == 0 ? comm.size() - 1 : 0;
    latency = exchange_seconds(peer, 8, 40, 50);
    large = exchange_seconds(peer, kLarge, 40, 2);
  }
  comm.barrier();
  if (!comm.is_root()) return;
  const double bandwidth = static_cast<double>(kLarge) / (large - latency);
  fmt::print(options.json == "-" ? stderr : stdout, "latency {:.2f} us, bandwidth {:.2f} GB/s each way\n",
             1e6 * latency, 1e-9 * bandwidth);
  write_json({{"latency", latency}, {"bandwidth", bandwidth}}, options.json);
}

}  // namespace breccia::bench

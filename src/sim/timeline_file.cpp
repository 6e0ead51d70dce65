#include "sim/timeline_file.hpp"

#include <fmt/format.h>

#include <array>
#include <span>
#include <string>
#include <vector>

#include "io/collectively.hpp"
#include "io/durable_file.hpp"

namespace breccia::sim {
namespace {

constexpr std::array kLanes = {"stages", "tiles", "messages"};

// Lines of this rank, each ending with a comma.
std::string events(const Timeline& timeline, Timeline::Clock::time_point start, int rank) {
  using Microseconds = std::chrono::duration<double, std::micro>;
  std::string text = fmt::format(R"({{"name": "process_name", "ph": "M", "pid": {0}, "args": {{"name": "rank {0}"}}}},)"
                                 "\n",
                                 rank);
  for (std::size_t lane = 0; lane < kLanes.size(); ++lane) {
    text += fmt::format(R"({{"name": "thread_name", "ph": "M", "pid": {}, "tid": {}, "args": {{"name": "{}"}}}},)"
                        "\n",
                        rank, lane, kLanes[lane]);
  }
  for (const Timeline::Bar& bar : timeline.bars()) {
    text += fmt::format(R"({{"name": "{}", "ph": "X", "pid": {}, "tid": {}, "ts": {:.3f}, "dur": {:.3f}}},)"
                        "\n",
                        bar.name, rank, static_cast<int>(bar.lane), Microseconds(bar.begin - start).count(),
                        Microseconds(bar.end - bar.begin).count());
  }
  return text;
}

}  // namespace

Timeline::Clock::time_point common_start(const mpi::Comm& comm) {
  comm.barrier();
  return Timeline::Clock::now();
}

void write_timeline(const std::filesystem::path& path, const Timeline& timeline, Timeline::Clock::time_point start,
                    const mpi::Comm& comm) {
  const std::string mine = events(timeline, start, comm.rank());
  std::vector<char> all = comm.allgather_arrays(std::span<const char>(mine));
  all.resize(all.size() - 2);  // the last comma
  io::on_root(comm,
              [&] { io::write_file(path, "{\"traceEvents\": [\n" + std::string(all.begin(), all.end()) + "\n]}\n"); });
}

}  // namespace breccia::sim

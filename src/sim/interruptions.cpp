#include "sim/interruptions.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "breccia/error.hpp"

namespace breccia::sim {
namespace {

// A window and a checkpoint may take longer than the last ones did.
constexpr double kSafety = 1.5;
constexpr double kSlack = 1.0;  // [s]

}  // namespace

Interruptions::Interruptions(const RunOptions& options, const Scene& scene, double time, Output& output,
                             const Budget& budget, double wall_before, std::uint64_t first_checkpoint,
                             const mpi::Comm& comm)
    : options_(options),
      output_(output),
      budget_(budget),
      wall_before_(wall_before),
      requests_(options.out, options.walltime, options.started, comm),
      checkpoints_(options.out, scene.output, time, first_checkpoint, comm) {}

bool Interruptions::at_window_start(const TimeLoop& loop, bool last_window) {
  const auto now = Clock::now();
  longest_window_ = std::max(longest_window_, std::chrono::duration<double>(now - window_start_).count());
  // The first checkpoint takes longer than a snapshot, which is compressed but has fewer fields.
  const double writing = std::max(checkpoints_.seconds(), 2.0 * output_.longest_write());
  const Requests requests = requests_.poll(kSafety * (longest_window_ + writing) + kSlack);
  if (requests.snapshot) output_.want_snapshot();
  if (requests.stop != nullptr || checkpoints_.due(loop.time(), last_window)) {
    loop.timers()("checkpoint", [&] { write(loop); });
  }
  if (requests.stop != nullptr) {
    stopped_ = fmt::format("stopped at t = {:.6g} s, step {}, because {}; {} is written, --restart auto continues",
                           loop.time(), loop.step(), requests.stop, name_);
  }
  window_start_ = Clock::now();
  return stopped_.empty();
}

void Interruptions::end_if_stopped() const {
  if (!stopped_.empty()) throw Error(ExitCode::kStopped, stopped_);
}

void Interruptions::write(const TimeLoop& loop) {
  RunState run{loop.state(), budget_.state(), output_.state(), options_.resolved};
  run.output.wall_seconds = wall_before_ + std::chrono::duration<double>(Clock::now() - start_).count();
  name_ = checkpoints_.write(loop.engine().save(), run);
}

}  // namespace breccia::sim

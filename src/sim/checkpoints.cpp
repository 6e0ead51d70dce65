#include "sim/checkpoints.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "breccia/error.hpp"
#include "io/checksum.hpp"
#include "io/collectively.hpp"
#include "sim/same_scene.hpp"

namespace breccia::sim {
namespace {

namespace fs = std::filesystem;

Restart read(const fs::path& path, const Scene& scene, const std::vector<ResolvedKey>& keys, const mpi::Comm& comm) {
  io::Checkpoint checkpoint = io::read_checkpoint(path, comm);
  Restart restart{std::move(checkpoint.engine), {}, 0};
  io::collectively(comm, [&] {
    restart.run = run_state_from(checkpoint.run);
    if (!keys.empty()) require_same_scene(restart.run.scene, keys, path.string());
  });
  std::uint64_t wanted = 0;
  for (const BodyParameters& body : scene.bodies) wanted += body.particles;
  const std::uint64_t found = comm.sum(restart.engine.particles);
  if (found != wanted) {
    throw UsageError(fmt::format("{} holds {} particles, but the scene has {}", path.string(), found, wanted));
  }
  return restart;
}

// Checkpoints that follow come after the one taken, in place of damaged ones; those of another folder, after all here.
std::uint64_t number_after(const fs::path& path, const fs::path& folder, const mpi::Comm& comm) {
  const std::vector<std::uint64_t> numbers = io::checkpoint_numbers(folder, comm);
  std::uint64_t next = numbers.empty() ? 0 : numbers.front() + 1;
  io::on_root(comm, [&] {
    for (const std::uint64_t number : numbers) {
      if (fs::equivalent(folder / io::checkpoint_name(number), path)) next = number + 1;
    }
  });
  return comm.min(next);
}

void say(const mpi::Comm& comm, const std::string& line) {
  if (comm.is_root()) fmt::print(stderr, "breccia: {}\n", line);
}

// What is wrong with the file as read_checkpoint() says it, without the file's name.
std::string without_name(const fs::path& path, const std::string& what) {
  const std::string name = path.string() + ": ";
  return what.starts_with(name) ? what.substr(name.size()) : what;
}

// The checkpoint, or in `damage` what is wrong with it; the same on all ranks. One of another format is not damaged:
// going back behind it would throw work away.
std::optional<Restart> read_whole(const fs::path& path, const Scene& scene, const std::vector<ResolvedKey>& keys,
                                  std::string& damage, const mpi::Comm& comm) {
  damage = io::damage_of(path, comm);
  if (!damage.empty()) return std::nullopt;
  try {
    return read(path, scene, keys, comm);
  } catch (const io::UnknownFormat&) {
    throw;
  } catch (const IoError& error) {
    damage = without_name(path, error.what());
  }
  return std::nullopt;
}

}  // namespace

std::optional<Restart> find_restart(const std::string& which, const fs::path& folder, const Scene& scene,
                                    const std::vector<ResolvedKey>& keys, const mpi::Comm& comm) {
  std::vector<fs::path> candidates{which};
  if (which == "auto") {
    candidates.clear();
    for (const std::uint64_t number : io::checkpoint_numbers(folder, comm)) {
      candidates.push_back(folder / io::checkpoint_name(number));
    }
    if (candidates.empty()) return std::nullopt;
  }
  std::string damaged;
  for (const fs::path& path : candidates) {
    std::string damage;
    std::optional<Restart> restart = read_whole(path, scene, keys, damage, comm);
    if (restart) {
      if (!damaged.empty()) say(comm, fmt::format("warning: {}; taking {} instead", damaged, path.string()));
      restart->next_number = number_after(path, folder, comm);
      say(comm, fmt::format("continuing from {} at t = {:.6g} s, step {}", path.string(), restart->run.loop.time,
                            restart->run.loop.step));
      return restart;
    }
    damaged += fmt::format("{}{} cannot be used: {}", damaged.empty() ? "" : ", ", path.string(), damage);
  }
  throw IoError(damaged + (which == "auto" ? "; there is no other checkpoint" : ""));
}

Checkpoints::Checkpoints(const fs::path& folder, const OutputParameters& output, double time,
                         std::uint64_t first_number, const mpi::Comm& comm)
    : folder_(folder), output_(output), comm_(comm), next_number_(first_number), last_time_(time) {}

bool Checkpoints::due(double time, bool last_window) const {
  const double waited = std::chrono::duration<double>(Clock::now() - last_wall_).count();
  const bool by_wall = output_.checkpoint_wall && waited >= *output_.checkpoint_wall;
  const double interval = output_.checkpoint_time;
  const bool by_time = interval > 0.0 && std::floor(time / interval) > std::floor(last_time_ / interval);
  const bool wanted = output_.checkpoint_wall || interval > 0.0;
  // Clocks of the ranks differ.
  return comm_.any(by_time || (last_window && wanted) || (by_wall && comm_.is_root()));
}

std::string Checkpoints::write(const EngineState& engine, const RunState& run) {
  const auto start = Clock::now();
  const std::uint64_t number = next_number_++;
  std::string name = io::checkpoint_name(number);
  io::write_checkpoint(folder_ / name, {engine, to_text(run)}, comm_);
  io::remove_other_checkpoints(folder_, number, output_.keep, comm_);
  last_time_ = run.loop.time;
  last_wall_ = Clock::now();
  seconds_ = std::chrono::duration<double>(last_wall_ - start).count();
  return name;
}

}  // namespace breccia::sim

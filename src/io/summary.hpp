// summary.json: the result of a run for other programs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "breccia/scene.hpp"
#include "mpi/comm.hpp"

namespace breccia::io {

/// Drifts from start to end, each over the scale that makes it comparable.
struct Conservation {
  double mass = 0.0;              ///< over the total mass
  double momentum = 0.0;          ///< over sum m |v|
  double angular_momentum = 0.0;  ///< over sum m |x cross v|
  double energy = 0.0;            ///< over max(kinetic + |potential|)
};

/// Wall time of one stage of the step.
struct StageTiming {
  std::string name;
  double seconds = 0.0;
  std::uint64_t calls = 0;
};

/// Messages of nodes between ranks; times are sums over the ranks.
struct HaloTiming {
  double in_flight_seconds = 0.0;    ///< from sending until everything expected was there
  double waited_seconds = 0.0;       ///< of that, with nothing else to do
  double hidden_fraction = 1.0;      ///< 1 - waited / in flight
  std::uint64_t bytes_per_step = 0;  ///< sent by all ranks, as the last sorting left it
  std::uint64_t key_exchanges = 0;   ///< sortings after which the ranks had to agree on shared blocks anew
};

struct RunSummary {
  std::uint64_t particles = 0;
  std::uint64_t steps = 0;
  double simulated_time = 0.0;  ///< [s]
  double time_step = 0.0;       ///< the last one [s]
  double wall_seconds = 0.0;    ///< of the time steps, without start and output
  int ranks = 1;
  int threads = 1;              ///< of each rank
  std::string device = "host";  ///< "host" or "cuda"
  std::string precision;        ///< "mixed" or "double"
  Conservation conservation;
  double damaged_fraction = 0.0;                      ///< mass-weighted mean of D
  std::uint64_t clamped_volumes = 0;                  ///< volume changes that were cut (hard case 3)
  nlohmann::json remnants = nlohmann::json::array();  ///< largest first (remnants_json.hpp)
  std::vector<StageTiming> stages;
  std::optional<HaloTiming> halo;        ///< none on one rank
  nlohmann::json gravity;                ///< what its evaluations came to; null without self-gravity
  nlohmann::json slabs;                  ///< axis, balance of the ranks' work, bytes of the halo at the end
  std::vector<ResolvedKey> scene;        ///< every key as resolved
  std::vector<std::string> unused_keys;  ///< keys that had no effect in this run
};

/// The content of summary.json; versions and machine are added here.
nlohmann::ordered_json to_json(const RunSummary& summary);

/// Writes the root's `summary` as `path`, in full or not at all. Collective. Throws IoError, the same on all ranks.
void write_summary(const std::filesystem::path& path, const RunSummary& summary, const mpi::Comm& comm);
/// Removes the summary of an earlier end, if there is one. Collective. Throws IoError, the same on all ranks.
void remove_summary(const std::filesystem::path& path, const mpi::Comm& comm);

}  // namespace breccia::io
